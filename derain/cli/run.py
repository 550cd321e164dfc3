"""``derain run``: cleans scans with an exported model or a filter."""

import argparse
import json
import sys
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from derain.cli.arguments import factor, threads
from derain.cli.odd_scans import Warnings
from derain.cli.outputs import refuse_clashes
from derain.errors import InputError
from derain.export.methods import load_method, named_method
from derain.export.runtime import Derainer
from derain.files import find_scans, read_scan, write_scan
from derain.files.labels import write_labels
from derain.filters import FILTERS, FilterDerainer, read_parameters
from derain.scan import Scan
from derain.stopwatch import Stopwatch

SUMMARY = "clean scans on a CPU, without torch"

DESCRIPTION = f"""\
Cleans scans: writes <stem>.label (1 = rain, one per row of the input) and the scan without its
rain, in the input's format with every field kept.

  derain run model.onnx scan.bin --out cleaned
  derain run model.onnx scans/ more/scan.pcd --out cleaned --threads 2 --json
  derain run model.onnx nuscenes/ --out cleaned --columns x,y,z,intensity,ring
  derain run dror scans/ --out cleaned
  derain run best.yaml scans/ --out cleaned
  derain run dsor scans/ --out cleaned --parameters best.yaml --set range_multiplier=0.08

METHOD is a model written by `derain export` (.onnx), parameters that `derain tune` wrote (.yaml),
or a filter: {", ".join(FILTERS)}.
A scan that cannot be read is reported and passed over; the exit code is then 2.
"""


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
    parser.add_argument(
        "method", metavar="METHOD", help="ONNX file, YAML file of parameters, or name of a filter"
    )
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
        help="what takes the scans' intensities to the method's unit, e.g. 255 (default: 1)",
    )
    parser.add_argument(
        "--parameters", type=Path, metavar="YAML", help="the method's parameters, as tuned"
    )
    parser.add_argument(
        "--set",
        type=_assignment,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="one parameter of the method, over those of --parameters; may be given again",
    )


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    method = load_method(*_named_method(arguments), arguments.threads)
    scans = find_scans(arguments.scans)
    refuse_clashes(scans, arguments.out)
    warn = Warnings(method)
    failed = 0
    for path in tqdm(scans, unit="scan", disable=None):
        try:
            cleaned = _clean(path, method, arguments, warn)
        except InputError as error:
            failed += 1
            tqdm.write(f"derain: {error}", sys.stderr)
            continue
        tqdm.write(json.dumps(asdict(cleaned)) if arguments.json else str(cleaned), sys.stdout)
    if failed:
        print(f"derain: {failed} of {len(scans)} scans could not be cleaned", file=sys.stderr)
    return 2 if failed else 0


def _clean(
    path: Path, method: Derainer | FilterDerainer, arguments: argparse.Namespace, warn: Warnings
) -> Cleaned:
    stopwatch = Stopwatch()
    with stopwatch.stage("read"):
        scan = read_scan(path, arguments.columns.split(","))
    seen = _in_unit_of_method(scan, arguments.intensity_scale)
    warn(seen)
    rain = method(seen, stopwatch)
    with stopwatch.stage("write"):
        _write(arguments.out / path.name, scan, rain)
    return Cleaned(
        str(path), len(scan), int(scan.valid.sum()), int(rain.sum()), stopwatch.milliseconds
    )


def _named_method(arguments: argparse.Namespace) -> tuple[str, dict[str, Any]]:
    """The method, and its parameters: those of the files, and over them those set one by one."""
    name, parameters = named_method(arguments.method)
    if arguments.parameters is not None:
        method, tuned = read_parameters(arguments.parameters)
        # Models are files, which have more than one name.
        if Path(method).resolve() != Path(name).resolve():
            raise InputError(
                arguments.parameters,
                f"holds parameters of {method}, not of {name}",
                f"Run {method} with it.",
            )
        parameters |= tuned
    return name, parameters | dict(arguments.set)


def _assignment(text: str) -> tuple[str, int | float | str]:
    """A parameter's name and value: a number where it reads as one."""
    name, equals, value = text.partition("=")
    if not (name and equals and value):
        raise argparse.ArgumentTypeError(f"{text} is not NAME=VALUE")
    for kind in (int, float):
        try:
            return name, kind(value)
        except ValueError:
            continue
    return name, value


def _write(path: Path, scan: Scan, rain: NDArray[np.bool_]) -> None:
    """Writes the cleaned scan, then its labels: where there are labels, the scan is complete."""
    write_scan(path, scan.take(~rain))
    write_labels(path.with_suffix(".label"), rain)


def _in_unit_of_method(scan: Scan, scale: float) -> Scan:
    if scan.intensity is None or scale == 1:
        return scan
    return replace(scan, intensity=scan.intensity * np.float32(scale))
