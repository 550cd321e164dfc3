"""``derain run``: cleans scans with an exported model."""

import argparse
import json
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from derain.cli.arguments import factor, threads
from derain.errors import InputError
from derain.export.runtime import Derainer
from derain.files import find_scans, read_scan, write_scan
from derain.files.labels import label_beside, write_labels
from derain.range_image import RangeView
from derain.scan import Scan
from derain.stopwatch import Stopwatch

SUMMARY = "clean scans on a CPU, without torch"

DESCRIPTION = """\
Cleans scans: writes <stem>.label (1 = rain, one per row of the input) and the scan without its
rain, in the input's format with every field kept.

  derain run model.onnx scan.bin --out cleaned
  derain run model.onnx scans/ more/scan.pcd --out cleaned --threads 2 --json
  derain run model.onnx nuscenes/ --out cleaned --columns x,y,z,intensity,ring

A scan that cannot be read is reported and passed over; the exit code is then 2.
"""

# Intensities this many times off the training data's are of another unit.
INTENSITY_MISMATCH = 30.0

# A larger share of points outside a model's grid are another sensor's, not a few strays.
MOST_OUTSIDE = 0.02


@dataclass(frozen=True)
class Cleaned:
    """What was done to one scan; ``milliseconds`` are by stage."""

    scan: str
    points: int
    valid: int
    rain: int
    milliseconds: dict[str, float]

    def __str__(self) -> str:
        total = sum(self.milliseconds.values())
        return f"{self.scan}: {self.points:,} points, {self.rain:,} of rain, {total:.0f} ms"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("model", type=Path, help="ONNX file written by `derain export`")
    parser.add_argument("scans", nargs="+", type=Path, help="scans, or folders of scans")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument("--threads", type=threads, default=0, help="threads (default: all cores)")
    parser.add_argument("--json", action="store_true", help="print one JSON object a scan")
    parser.add_argument(
        "--columns",
        default="x,y,z,intensity",
        help="names of the columns of .bin and .npy files (default: %(default)s)",
    )
    parser.add_argument(
        "--intensity-scale",
        type=factor,
        default=1.0,
        metavar="FACTOR",
        help="what takes the scans' intensities to the model's unit, e.g. 255 (default: 1)",
    )


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    derainer = Derainer(arguments.model, arguments.threads)
    scans = find_scans(arguments.scans)
    _refuse_clashes(scans, arguments.out)
    failed = 0
    warned: set[str] = set()
    for path in tqdm(scans, unit="scan", disable=None):
        try:
            cleaned = _clean(path, derainer, arguments, warned)
        except InputError as error:
            failed += 1
            tqdm.write(f"derain: {error}", sys.stderr)
            continue
        tqdm.write(json.dumps(asdict(cleaned)) if arguments.json else str(cleaned), sys.stdout)
    if failed:
        print(f"derain: {failed} of {len(scans)} scans could not be cleaned", file=sys.stderr)
    return 2 if failed else 0


def _clean(
    path: Path, derainer: Derainer, arguments: argparse.Namespace, warned: set[str]
) -> Cleaned:
    stopwatch = Stopwatch()
    with stopwatch.stage("read"):
        scan = read_scan(path, arguments.columns.split(","))
    seen = _in_unit_of_model(scan, arguments.intensity_scale)
    _warn_once(warned, "intensity", _intensity_warning(seen, derainer))
    _warn_once(warned, "grid", _grid_warning(seen, derainer))
    rain = derainer.probability(seen, stopwatch) > derainer.spec.threshold
    with stopwatch.stage("write"):
        _write(arguments.out / path.name, scan, rain)
    return Cleaned(
        str(path), len(scan), int(scan.valid.sum()), int(rain.sum()), stopwatch.milliseconds
    )


def _refuse_clashes(scans: Sequence[Path], out: Path) -> None:
    """Refuses to overwrite a scan by its cleaned self, or labels by others."""
    stems = Counter(scan.stem for scan in scans)
    for scan in scans:
        if (out / scan.name).resolve() == scan.resolve():
            raise InputError(out, f"would overwrite {scan}", "Give --out another folder.")
        if out.resolve() == label_beside(scan).parent.resolve():
            raise InputError(out, f"holds the labels of {scan}", "Give --out another folder.")
        if stems[scan.stem] > 1:
            raise InputError(
                scan, "another scan has the same name", "Clean them in two runs, each to its --out."
            )


def _write(path: Path, scan: Scan, rain: NDArray[np.bool_]) -> None:
    """Writes the cleaned scan, then its labels: where there are labels, the scan is complete."""
    write_scan(path, scan.take(~rain))
    write_labels(path.with_suffix(".label"), rain)


def _in_unit_of_model(scan: Scan, scale: float) -> Scan:
    if scan.intensity is None or scale == 1:
        return scan
    return replace(scan, intensity=scan.intensity * np.float32(scale))


def _intensity_warning(scan: Scan, derainer: Derainer) -> str | None:
    """What is odd about a scan's intensities, given the data that the model was trained on."""
    spec = derainer.spec
    if scan.intensity is None:
        return f"no intensity: the mean of {spec.data}, {spec.mean_intensity:.3g}, stands in"
    valid = scan.valid
    mean = float(scan.intensity[valid].mean(dtype=np.float64)) if valid.any() else 0.0
    expected = spec.mean_intensity
    comparable = mean > 0 and expected > 0
    if comparable and not 1 / INTENSITY_MISMATCH < mean / expected < INTENSITY_MISMATCH:
        return (
            f"mean intensity {mean:.3g}, but {expected:.3g} where the model was trained "
            f"(unit {spec.intensity_unit}): see --intensity-scale"
        )
    return None


def _grid_warning(scan: Scan, derainer: Derainer) -> str | None:
    """What of a scan the model's range image does not show."""
    xyz = scan.xyz[scan.valid]
    if not isinstance(derainer.view, RangeView) or not len(xyz):
        return None
    outside = float((derainer.view.grid.pixel(xyz) < 0).mean())
    if outside <= MOST_OUTSIDE:
        return None
    return f"{outside:.0%} of the points lie outside the grid of {derainer.spec.data}, and stay"


def _warn_once(warned: set[str], subject: str, warning: str | None) -> None:
    # A folder's scans have the same fault, with other numbers: the first one speaks for all.
    if warning is not None and subject not in warned:
        warned.add(subject)
        tqdm.write(f"derain: warning: {warning}", sys.stderr)
