"""Trains a network to take the rain out of a sensor's scans, from an unlabelled recording.

The recording is consecutive scans in a folder. A teacher labels each point rain, not rain or
unknown; a network is trained on these labels, exported as one ONNX file and proved; a report
describes how far to trust it, with the commands that repeat each step.

  derain learn recording/ --out model.onnx
  derain learn recording/ --out model.onnx --poses standing    the sensor stood still
  derain learn recording/ --out model.onnx --teacher persistence
  derain learn recording/ --out model.onnx --model salsanext --blind
  derain learn recording/ --out model.onnx --start mine.ckpt   start from a model of yours
  derain learn recording/ --out model.onnx --rerun report.rrd  look at teacher and student
  derain learn drive.mcap --out model.onnx --topic /velodyne_points
  derain run model.onnx more_scans/ --out cleaned              use the model

The default teacher is the model that comes with derain, which sees the scans before and after each;
the network begins with the weights of the same model. If --model or --blind selects another
network, its weights are random. The teacher persistence uses free space alone: solid things stay in
their place, and drops do not. The report compares the two. Labels beside the scans are not read:
`derain bench` measures the finished model by them. The teacher's labels, runs and report go to a
folder beside the model, which a second run clears.
"""

import argparse
from pathlib import Path

from derain.cli.options import add_columns, add_poses, add_topic, count, file_named
from derain.cli.outputs import print_lines
from derain.cli.playback import refuse_unusable, write_and_report
from derain.default import DEFAULT
from derain.learning.start import START_HELP
from derain.sources.method import Method
from derain.stores.url import place_of
from derain.system.extras import EXPORT_LIBRARIES, TRAINING_LIBRARIES, require
from derain.workflows.learn_config import STUDENTS, LearnConfig

# The Rerun file shows this many scans of a long recording, spread over all of it.
MOST_SHOWN = 100


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument(
        "recording",
        nargs="+",
        type=place_of,
        help="folders of consecutive scans, or bags, in order",
    )
    parser.add_argument(
        "--out", type=file_named(".onnx"), required=True, help="the ONNX file to write"
    )
    parser.add_argument(
        "--model", choices=STUDENTS, help="network to train (default: that of --start)"
    )
    parser.add_argument("--start", metavar="MODEL", help=START_HELP)
    parser.add_argument(
        "--teacher",
        default=DEFAULT,
        metavar="METHOD",
        help="method that labels the scans: the model that comes with derain (%(default)s), "
        "persistence, a filter such as crf, or a model of yours (.onnx)",
    )
    add_poses(parser)
    parser.add_argument("--epochs", type=count, help="passes over the scans (default: by model)")
    parser.add_argument(
        "--blind",
        action="store_true",
        help="learn without intensity: for sensors of other units, or where it is of no use",
    )
    parser.add_argument(
        "--work", type=Path, help="folder for everything else (default: beside the model)"
    )
    parser.add_argument(
        "--rerun",
        type=Path,
        metavar="FILE",
        help="Rerun file to write (.rrd) with teacher and student, scan after scan; needs "
        "derain[view]",
    )
    add_columns(parser)
    add_topic(parser)


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    require("learn", *TRAINING_LIBRARIES, *EXPORT_LIBRARIES)
    from derain.workflows.learn import learn

    if arguments.rerun is not None:
        refuse_unusable(arguments.rerun)
    config = LearnConfig(
        recordings=arguments.recording,
        topic=arguments.topic,
        out=arguments.out,
        folder=arguments.work,
        model=arguments.model,
        teacher=arguments.teacher,
        poses=arguments.poses,
        blind=arguments.blind,
        columns=arguments.columns,
        epochs=arguments.epochs,
        start=arguments.start,
    )
    results = learn(config, print_lines)
    print_lines(f"\n{results}\n\nReport: {results.path}")
    print_lines(f"Clean other scans: derain run {results.model} SCANS --out cleaned")
    if arguments.rerun is not None:
        _write_playback(config, arguments.rerun)
    return 0


def _write_playback(config: LearnConfig, out: Path) -> None:
    """Writes a Rerun file of the teacher's labels and the student's, scan after scan."""
    from derain.datamodules.taught import Taught
    from derain.export.runtime import Derainer
    from derain.pictures.selection import Labels, Selection
    from derain.sources.source import Frames
    from derain.sources.spread import evenly_spaced

    data = Taught(str(config.taught))
    every = [*data.frames("train"), *data.frames("validation")]
    frames = sorted(every, key=lambda frame: (frame.sequence, frame.number))
    selection = Selection(Frames(frames), evenly_spaced(range(len(frames)), MOST_SHOWN))
    methods: dict[str, Method] = {"student": Derainer(config.out)}
    write_and_report(out, selection, methods, Labels(data.card, "teacher"))
