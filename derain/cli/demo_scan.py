"""The end of the demonstration: the model that comes with derain, on scans of the user's own."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from derain.cli.narration import Narrator
from derain.cli.outputs import say
from derain.cli.results import last_line
from derain.default import DEFAULT
from derain.files.labels import LABEL, read_labels, semantic
from derain.scan import Scan
from derain.sources.folders import named_frames

# Where bands of range start that the share taken is told of, metres; the last one is open.
BANDS = (0, 10, 20, 40, 80)


def clean_own_scans(narrator: Narrator, scans: Path, columns: Sequence[str], out: Path) -> None:
    """Cleans a scan or a folder of them, and says what was taken, with a picture of the first.

    Args:
        narrator: Runs the command.
        scans: The scan, or the folder.
        columns: Names of the columns of files that do not name them.
        out: Folder for the clean scans and the picture.

    Raises:
        InputError: A scan that cannot be read.
        SystemExit: The command failed.
    """
    from derain.pictures.scan_pictures import before_after_figure, save

    told = len(narrator.warned)
    narrator.step(
        *("run", DEFAULT, str(scans), "--out", str(out), "--columns", ",".join(columns)),
        result=last_line,
        leaves=out,  # a scan that cannot be cleaned is reported, and the others are shown
    )
    for warning in narrator.warned[told:]:
        say(f"  {warning}")
    counted = np.zeros((len(BANDS), 2), np.int64)
    picture = out / "before_after.png"
    for frame in named_frames([scans], columns):
        labels = out / f"{frame.key}{LABEL}"
        if not labels.exists():
            continue
        scan = frame.read()
        rain = semantic(read_labels(labels, len(scan))) == 1
        if not counted.any():
            heading = f"{frame.key}, cleaned by the model that comes with derain"
            save(before_after_figure(scan, rain, heading), picture)
        counted += taken_by_range(scan, rain)
    if counted.any():
        say(f"  taken by range: {_shares(counted)}")
        say(f"  before and after: {picture}")


def taken_by_range(scan: Scan, rain: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Points that can be judged and those called rain, by band of range, int64 (bands, 2).

    Args:
        scan: The scan, of N points.
        rain: What is called rain, bool (N,).
    """
    band = np.searchsorted(BANDS, scan.range[scan.valid], side="right") - 1
    points = np.bincount(band, minlength=len(BANDS))
    taken = np.bincount(band[rain[scan.valid]], minlength=len(BANDS))
    return np.stack([points, taken], axis=1)


def _shares(counted: NDArray[np.int64]) -> str:
    names = [f"{start}-{end} m" for start, end in pairwise(BANDS)] + [f"{BANDS[-1]}+ m"]
    return ", ".join(
        f"{name} {taken / points:.2%}"
        for name, (points, taken) in zip(names, counted.tolist(), strict=True)
        if points
    )
