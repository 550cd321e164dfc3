"""Exports a checkpoint as one ONNX file, proves it against PyTorch, and times it.

  derain export outdet.ckpt --out outdet.onnx
  derain export outdet.ckpt --out outdet.onnx --scan scans/000000.bin --threads 2
  derain export salsanext.ckpt --out salsanext.onnx --int8 --calibration scans/
  derain export outdet.ckpt --out outdet.onnx --candidates WADS/sequences/36 --card wads

With --candidates, the model judges only points within a few bounds of range, height and intensity.
derain fits the bounds to labelled scans, so that they hold, with a margin, all but a thousandth of
the rain that the network finds there, and prints their cost. For points within the bounds, the
model gives the same answer as without them.

If the proof fails, derain leaves no file. With --int8, convolutions compute in eight bits, scaled
to their inputs on scans of the calibration folder. The network must find rain in these scans, and
their intensities must have the unit of the training data.
The file is the same for every runtime. If you name another, it has to pass the proof too.
"""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from derain.bags.names import split
from derain.cli import options
from derain.cli.method_options import add_runtime, runtime_of
from derain.cli.outputs import print_lines
from derain.default import DEFAULT, default_checkpoint
from derain.errors import InputError
from derain.files.reading import is_file
from derain.sources.folders import named_frames
from derain.sources.frame import Frame
from derain.sources.spread import evenly_spaced
from derain.system.extras import EXPORT_LIBRARIES, require
from derain.system.notices import Notices
from derain.views.channels import extra_channels, with_columns

if TYPE_CHECKING:
    from derain.datamodules.labelled import LabelledScans
    from derain.models.base import DerainingModule
    from derain.scan import Scan


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("checkpoint", help=f"checkpoint of derain, or {DEFAULT}")
    parser.add_argument(
        "--out", type=options.file_named(".onnx"), required=True, help="the ONNX file to write"
    )
    parser.add_argument(
        "--int8", action="store_true", help="compute in eight bits (networks with convolutions)"
    )
    parser.add_argument(
        "--calibration",
        type=Path,
        nargs="+",
        default=[],
        help="scans, or folders of scans, for --int8",
    )
    parser.add_argument(
        "--candidates",
        type=Path,
        nargs="+",
        metavar="DATA",
        help="labelled scans, folders of them, or a data set, to fit bounds of rain to",
    )
    parser.add_argument(
        "--card", help="data card of the labelled scans (default: found by their folders)"
    )
    parser.add_argument(
        "--scan", type=Path, help="scan to time the model on (default: a made-up one)"
    )
    options.add_columns(parser)
    options.add_intensity_scale(parser, of="calibration and labelled ")
    options.add_threads(parser)
    add_runtime(parser, help="prove and time the file by this runtime too")
    parser.add_argument(
        "--repeats", type=options.count, default=30, help="timed runs (default: %(default)s)"
    )


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    require("export", *EXPORT_LIBRARIES)
    from derain.export.onnx_file import export
    from derain.export.quantisation import CALIBRATION_SCANS
    from derain.export.timing import measure_latency
    from derain.models.checkpoint import load_model

    out, scan = arguments.out, arguments.scan
    if scan is not None and not (is_file(scan) or split(scan)):
        raise InputError(scan, "there is no such file", "Check --scan.")
    if arguments.int8 != bool(arguments.calibration):
        reason = "needs --calibration, and that needs it"
        raise InputError("--int8", reason, "Give both or neither.")
    runtime = runtime_of(arguments)
    is_default = arguments.checkpoint == DEFAULT
    model = load_model(default_checkpoint() if is_default else arguments.checkpoint)
    frames = named_frames(arguments.calibration, arguments.columns).map(
        lambda frame: frame.with_intensity_times(arguments.intensity_scale)
    )
    calibration = evenly_spaced(frames, CALIBRATION_SCANS)
    # The proof does not show scans of another unit: both models judge the same ones.
    notices = Notices()
    for frame in calibration:
        notices.warn(frame.name, model.spec.issues(frame.read()))
    notices.warn_of_repeats()
    if arguments.candidates:
        _fit_candidates(model, options.labelled(arguments.candidates, arguments))
    print(export(model, out, calibration, runtime))
    print_lines(f"Wrote {out} ({out.stat().st_size:,} bytes)\n")
    threads, repeats = arguments.threads, arguments.repeats
    print(measure_latency(out, scan, arguments.columns, threads, repeats, runtime))
    return 0


def _fit_candidates(model: "DerainingModule", data: "LabelledScans") -> None:
    """Fits a model's candidates to labelled scans, and prints their bounds and their cost."""
    from derain.export.candidates import fit_network_candidates
    from derain.learning.task import EXAMPLE_SCANS

    notices = Notices()

    def read(frame: Frame) -> "Scan":
        scan = data.reader.read_measured(frame)
        notices.warn(frame.name, model.spec.issues(scan))
        return with_columns(scan, extra_channels(model.channels))

    scans = map(read, evenly_spaced(data.frames("train"), EXAMPLE_SCANS))
    fitted = fit_network_candidates(model, scans, data.card)
    notices.warn_of_repeats()
    model.adopt(replace(model.spec, candidates=fitted.candidates))
    print(fitted)
