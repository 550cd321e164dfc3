"""``derain tune``: the best parameters of a method, on labelled scans."""

import argparse
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml
from tqdm import tqdm

from derain import __version__
from derain.cards.rain_found import require_rain
from derain.cli.arguments import add_threads, command_line, count, file_named, share
from derain.cli.labelled_data import add_data_arguments, labelled
from derain.cli.method_options import list_filters
from derain.cli.outputs import print_lines
from derain.default import DEFAULT
from derain.errors import InputError
from derain.export.methods import PARAMETER_SUFFIXES
from derain.files.atomic import replacing, require_writable
from derain.filters import FILTERS, filter_from
from derain.filters.derainer import CANDIDATES
from derain.sources.training_record import training_overlap
from derain.system.extras import OPTUNA, require
from derain.system.notices import Notices
from derain.views.candidate_fit import RAIN_INSIDE, fit_candidates
from derain.views.candidates import Candidates
from derain.views.scan_issues import ScanChecker, outside_view

if TYPE_CHECKING:
    from derain.datamodules.scan_data import ScanData
    from derain.export.tuning import LabelledNeighbourhoods, Tuned
    from derain.scan import Scan
    from derain.sources.frame import Frame

DESCRIPTION = """\
Finds the parameters of a filter, or the threshold of a model, with the greatest IoU of rain on
labelled scans, and writes them for `derain run --parameters` and `derain bench --methods`.

  derain tune dsor --data scans/ --card wads --out dsor.yaml
  derain tune dror --data REHEARSE3D_PUBLIC --scans 100 --trials 100 --out dror.yaml
  derain tune dror --data REHEARSE3D_PUBLIC --trials 300 --storage study.db --out dror.yaml
  derain tune outdet.onnx --data REHEARSE3D_PUBLIC --out outdet.yaml
  derain tune default --data scans/ --card wads --out default.yaml

Optuna searches the parameters of a filter, starting at the defaults. The neighbours of each scan
are found once, and take some 150 bytes per point. With --storage, a second call continues up to
--trials. With --candidates, the filter looks for rain only within bounds of range, height and
intensity that hold a share of the rain.
The threshold of a model follows from its probabilities, without trials.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("method", metavar="METHOD", help="ONNX file, default or a filter (below)")
    list_filters(parser)
    add_data_arguments(parser, part="validation")
    parser.add_argument(
        "--out", type=file_named(*PARAMETER_SUFFIXES), required=True, help="YAML file to write"
    )
    parser.add_argument(
        "--scans", type=count, default=100, help="number of random scans (default: %(default)s)"
    )
    parser.add_argument(
        "--trials", type=count, default=100, help="trials for a filter (default: %(default)s)"
    )
    parser.add_argument("--seed", type=int, default=0, help="random seed (default: 0)")
    parser.add_argument(
        "--candidates",
        type=share,
        nargs="?",
        const=RAIN_INSIDE,
        metavar="SHARE",
        help="limit a filter to bounds that hold SHARE of the rain (default SHARE: %(const)s)",
    )
    parser.add_argument("--storage", type=Path, help="SQLite file for the study of a filter")
    add_threads(parser)


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    if arguments.method in FILTERS:
        require("tune", OPTUNA)
    notices = Notices()
    data = labelled(
        arguments.data,
        arguments.card,
        arguments.columns,
        arguments.intensity_scale,
        topic=arguments.topic,
    )
    frames = _drawn(data.frames(arguments.part), arguments.scans, arguments.seed)
    require_writable(arguments.out)
    method, threads = arguments.method, arguments.threads
    if method in FILTERS:
        inside = arguments.candidates
        candidates = None if inside is None else _candidates(inside, data, frames)
        scans = _neighbourhoods(method, data, frames, candidates, threads, notices)
        names = [frame.name for frame in frames]
        search = (arguments.trials, arguments.seed, arguments.storage)
        tuned = _tuned_filter(method, scans, names, *search)
        if candidates is not None:
            bounded = {**tuned.parameters, CANDIDATES: candidates.as_dict()}
            tuned = replace(tuned, parameters=bounded)
    elif arguments.candidates is not None:
        raise InputError("--candidates", "a model has its own", "Give it to `derain export`.")
    else:
        tuned = _tuned_model(method, data, frames, threads, notices)
    notices.warn_of_repeats()
    facts = (
        f"IoU {tuned.iou:.4f} on {len(frames)} scans of {data.card.name}, "
        f"{tuned.default_iou:.4f} with the defaults"
    )
    content = {"method": _relative_to(arguments.out.parent, method), **tuned.parameters}
    with replacing(arguments.out) as temporary:
        temporary.write_text(
            f"# derain {__version__}: {command_line(arguments, 'method')}\n"
            f"# {facts}\n{yaml.safe_dump(content, sort_keys=False)}",
            "utf-8",
        )
    print_lines(f"{method}: {facts}")
    for name, value in tuned.parameters.items():
        if name != CANDIDATES:  # printed already
            print(f"  {name}: {value}")
    return 0


def _candidates(inside: float, data: "ScanData", frames: Sequence["Frame"]) -> Candidates | None:
    """Bounds that hold a share of the scans' rain; None if no bounds tell rain from the rest."""

    def known() -> Iterator[tuple[Any, Any]]:
        for frame in tqdm(frames, desc="bounding rain", unit="scan", disable=None):
            yield data.card.known_points(data.read_measured(frame))

    candidates = fit_candidates(known(), ("intensity",), inside)
    print_lines(f"candidates: {candidates or 'every point, for no bounds tell rain from the rest'}")
    return candidates


def _neighbourhoods(
    method: str,
    data: "ScanData",
    frames: Sequence["Frame"],
    candidates: Candidates | None,
    threads: int,
    notices: Notices,
) -> list["LabelledNeighbourhoods"]:
    """The labelled scans with the neighbours that a filter needs; one of them has rain."""
    from derain.export.tuning import LabelledNeighbourhoods, neighbours_to_find

    neighbours, filter_ = neighbours_to_find(method), filter_from(method, {})
    scans = [
        LabelledNeighbourhoods.of(
            _read(data, filter_, notices, frame), data.card, neighbours, threads, candidates
        )
        for frame in tqdm(frames, desc="finding neighbours", unit="scan", disable=None)
    ]
    require_rain(any(scan.rain.any() for scan in scans), data.card, "--data")
    return scans


def _tuned_filter(
    method: str,
    scans: Sequence["LabelledNeighbourhoods"],
    names: Sequence[str],
    trials: int,
    seed: int,
    storage: Path | None,
) -> "Tuned":
    from derain.export.tuning import Search, tune_filter

    with tqdm(desc="tuning", unit="trial", total=trials, disable=None) as progress:
        search = Search(trials, seed, storage, names, progress.update)
        return tune_filter(method, scans, search)


def _tuned_model(
    method: str, data: "ScanData", frames: Sequence["Frame"], threads: int, notices: Notices
) -> "Tuned":
    from derain.export.methods import load_method_of_one_scan
    from derain.export.runtime import Derainer
    from derain.export.tuning import tune_threshold

    derainer = load_method_of_one_scan(method, {}, threads)
    assert isinstance(derainer, Derainer)  # filters are tuned by _tuned_filter

    def judged() -> Iterator[tuple[Any, Any]]:
        for frame in tqdm(frames, desc="judging", unit="scan", disable=None):
            scan = _read(data, derainer.spec, notices, frame)
            known = scan.valid & ~data.card.unknown_of(scan)
            judgement = derainer.judge(scan)
            outside = outside_view(scan, judgement.judged, derainer.spec.data)
            notices.warn(frame.name, outside)
            yield judgement.probability[known], data.card.rain_of(scan)[known]

    note = training_overlap(method, derainer.spec, data.card, frames)
    if note is not None:
        tqdm.write(f"derain: warning: {note}", sys.stderr)
    scans = list(judged())
    require_rain(any(rain.any() for _, rain in scans), data.card, "--data")
    return tune_threshold(scans, derainer.spec.threshold)


def _read(data: "ScanData", checker: ScanChecker, notices: Notices, frame: "Frame") -> "Scan":
    """Reads a scan, and warns of what is odd about it for the method."""
    scan = data.read_measured(frame)
    notices.warn(frame.name, checker.issues(scan))
    return scan


def _drawn(frames: Sequence["Frame"], most: int, seed: int) -> list["Frame"]:
    """At most so many of the scans, drawn at random, in their order."""
    generator = np.random.default_rng(seed)
    chosen = generator.choice(len(frames), min(most, len(frames)), replace=False)
    return [frames[number] for number in np.sort(chosen)]


def _relative_to(folder: Path, method: str) -> str:
    """The method as a file in a folder names it: a model by the way from there to it."""
    if method == DEFAULT or method in FILTERS:
        return method
    return Path(os.path.relpath(Path(method).resolve(), folder.resolve())).as_posix()
