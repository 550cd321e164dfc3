"""``derain learn``: a derainer for a sensor, from an unlabelled recording of it."""

import argparse
import shutil
from pathlib import Path

from derain.cli.arguments import count, file_named
from derain.cli.bag_options import add_topic, in_topic
from derain.cli.learning_student import (
    STUDENTS,
    epochs_of,
    network_options,
    with_network,
    without_intensity,
)
from derain.cli.lesson import PERSISTENCE, Lesson
from derain.cli.narration import WARNING_OF_DERAIN, Narrator
from derain.cli.outputs import refuse_unwritable, say
from derain.cli.pose_options import add_poses
from derain.cli.results import last_line, proof_of
from derain.cli.scan_options import add_columns
from derain.cli.start import START_HELP
from derain.cli.training.lightning_silence import no_news
from derain.cli.view_recording import refuse_unusable
from derain.errors import InputError
from derain.files.atomic import replacing
from derain.odometry.posed import ODOMETRY
from derain.sources.folders import named_frames
from derain.sources.recordings import recordings_of
from derain.sources.records import POSES
from derain.sources.source import Source
from derain.system.extras import OF_EXPORT, OF_TRAINING, require
from derain.teaching.held_out import FEWEST_SCANS
from derain.teaching.manifest import HELD_OUT_PART, TAUGHT_MANIFEST, Manifest

SUMMARY = "a derainer from an unlabelled recording, in about six minutes"

DESCRIPTION = """\
Learns to take the rain out of a sensor's scans from a recording of it that nobody labelled:
consecutive scans in a folder. A teacher says of each point whether it is rain, not rain, or not
known; a network learns that, is exported as one ONNX file and proved; and a report says how far to
trust it. Every step is a command of derain, printed before it runs.

  derain learn recording/ --out model.onnx
  derain learn recording/ --out model.onnx --poses standing    the sensor stood still
  derain learn recording/ --out model.onnx --model salsanext --blind
  derain learn recording/ --out model.onnx --teacher crf       no motion needed; dim rain only
  derain learn recording/ --out model.onnx --start default     go on from the model of derain
  derain learn recording/ --out model.onnx --rerun report.rrd  look at teacher and student
  derain learn drive.mcap --out model.onnx --topic /velodyne_points
  derain run model.onnx more_scans/ --out cleaned              what it is for

The teacher is persistence by default, which judges a point by the scans before and after: solid
things are where they were, drops are not. Labels that lie beside the scans are not read; with
--card, they measure the finished model, for the record. Labels, runs and report go to a folder
beside the model, which a second run clears.
"""

# The commands that it runs; of these, odometry only where nothing says where the sensor was.
STEPS = ("odometry", "teach", "fit", "export")

# By this file a folder is known for one that a second run may clear.
MARK = "learning.txt"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument(
        "recording",
        nargs="+",
        type=Path,
        help="folders of consecutive scans, or bags, in order",
    )
    parser.add_argument(
        "--out", type=file_named(".onnx"), required=True, help="the ONNX file to write"
    )
    parser.add_argument("--model", choices=STUDENTS, help="(default: outdet, or that of --start)")
    parser.add_argument("--start", metavar="MODEL", help=START_HELP)
    parser.add_argument(
        "--teacher",
        default=PERSISTENCE,
        metavar="METHOD",
        help="what labels the scans: persistence, a filter such as crf, or a model (.onnx)",
    )
    add_poses(parser)
    parser.add_argument("--epochs", type=count, help="passes over the scans (default: by model)")
    parser.add_argument(
        "--blind",
        action="store_true",
        help="learn without intensity: for sensors of other units, or where it says nothing",
    )
    parser.add_argument("--work", type=Path, help="folder for all else (default: beside the model)")
    parser.add_argument(
        "--card", help="measure the finished model by the labels beside the scans, which this "
        "data card explains, for the record",
    )  # fmt: skip
    parser.add_argument(
        "--rerun",
        type=Path,
        metavar="FILE",
        help="Rerun file to write (.rrd), which shows teacher and student scan after scan; needs "
        "derain[view]",
    )
    add_columns(parser)
    add_topic(parser)


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    require("learn", *OF_TRAINING, *OF_EXPORT)
    out: Path = arguments.out
    learn(
        Lesson(
            recordings=in_topic(arguments.recording, arguments),
            out=out,
            work=arguments.work or out.with_name(f"{out.stem}_learning"),
            model=arguments.model,
            teacher=arguments.teacher,
            poses=arguments.poses,
            blind=arguments.blind,
            columns=arguments.columns,
            epochs=arguments.epochs,
            card=arguments.card,
            start=arguments.start,
            rerun=arguments.rerun,
        )
    )
    return 0


def learn(lesson: Lesson) -> None:
    """Runs every step, and prints its result.

    Raises:
        InputError: Too few scans, or too few that can be labelled, a folder that holds something
            else, or nothing to be learnt.
        SystemExit: A step failed.
    """
    from derain.cli.learning_playback import show_lesson
    from derain.cli.learning_report import LearningReport
    from derain.cli.main import main as derain

    lesson = with_network(lesson)
    source = named_frames(lesson.recordings, lesson.columns)
    _refuse_too_few(lesson, source)
    refuse_unwritable(lesson.out)
    if lesson.rerun is not None:
        refuse_unusable(lesson.rerun)
    _clear(lesson.work)
    steps = len(STEPS) - (not lesson.needs_odometry(source))
    narrator = Narrator(derain, lesson.work / "log.txt", steps)
    say(f"{len(source):,} scans to learn from. All but the model goes to {lesson.work}/")
    if not lesson.blind and source[0].read().intensity is None:
        lesson = without_intensity(lesson)
        say("They have no intensities: the network learns without.")
    _teach(narrator, lesson, source)
    _refuse_too_few_labelled(lesson, source, narrator)
    report = LearningReport(lesson, narrator)
    report.write()  # what the teacher says is worth reading, whatever comes after
    report.refuse_clean()
    with no_news():  # which would stand between the lines of ours
        _fit(narrator, lesson)
    narrator.step(
        *("export", str(lesson.checkpoint), "--out", str(lesson.out)),
        *("--scan", report.held_out[0].name, "--columns", ",".join(lesson.columns)),
        result=lambda printed: f"{lesson.out.stat().st_size:,} bytes; {proof_of(printed)}",
    )
    report.ask_the_student()
    report.write()
    if lesson.rerun is not None:
        show_lesson(report, lesson.rerun)
    say(f"\n{report.summary}\n\nReport: {report.path}")
    say(f"What the model is for: derain run {lesson.out} SCANS --out cleaned")
    say(f"Done in {narrator.elapsed}; what the commands said: {narrator.log}")


def _refuse_too_few(lesson: Lesson, source: Source) -> None:
    """Refuses a recording in which nothing can be held out."""
    if len(source) < FEWEST_SCANS:
        raise InputError(
            lesson.recordings[0],
            f"{len(source)} scan{'s' * (len(source) > 1)}: too few to learn from some and choose "
            "by others",
            f"Record {FEWEST_SCANS} or more, one right after the other; twenty teach a good deal.",
        )


def _refuse_too_few_labelled(lesson: Lesson, source: Source, narrator: Narrator) -> None:
    """Refuses a recording of which so few scans are labelled that none of them is held out."""
    scans = Manifest.read(lesson.taught).scans
    if any(scan.part == HELD_OUT_PART for scan in scans):
        return
    warnings = [
        line.removeprefix(WARNING_OF_DERAIN)
        for line in narrator.warned
        if line.startswith(WARNING_OF_DERAIN)
    ]
    reasons = f": {warnings[0]}" if warnings else ""
    raise InputError(
        lesson.recordings[0],
        f"only {len(scans)} of {len(source)} scans could be labelled, and a recording needs "
        f"{FEWEST_SCANS}{reasons}",
        f"See {narrator.log} for each scan, and record scans that overlap.",
    )


def _clear(work: Path) -> None:
    """Makes the folder of all but the model anew.

    Raises:
        InputError: It holds something that no earlier run has written.
    """
    mark = work / MARK
    if work.is_dir() and any(work.iterdir()) and not mark.is_file():
        raise InputError(
            work, "holds something other than what an earlier run left", "Give another --work."
        )
    refuse_unwritable(mark)
    for left in work.iterdir():
        shutil.rmtree(left) if left.is_dir() and not left.is_symlink() else left.unlink()
    with replacing(mark) as temporary:
        temporary.write_text("Written by derain learn, which clears this folder.\n", "utf-8")


def _teach(narrator: Narrator, lesson: Lesson, source: Source) -> None:
    """Finds out where the sensor was, if need be, and has the scans labelled."""
    scans, columns = [*map(str, lesson.recordings)], ("--columns", ",".join(lesson.columns))
    poses = lesson.poses
    if lesson.needs_odometry(source):
        found = lesson.work / (POSES if len(recordings_of(source)) == 1 else "poses")
        command = ("odometry", *scans, "--out", str(found), *columns)
        narrator.step(*command, result=last_line, leaves=found)
        # Where it failed, a file does not say; the teacher, who asks itself, leaves a gap there.
        poses = ODOMETRY if narrator.failed else str(found)
    where = () if poses is None else ("--poses", poses)
    narrator.step(
        *("teach", lesson.teacher, *scans, "--out", str(lesson.taught), *where, *columns),
        result=lambda _: f"{len(Manifest.read(lesson.taught).scans):,} scans labelled",
        leaves=lesson.taught / TAUGHT_MANIFEST,
    )


def _fit(narrator: Narrator, lesson: Lesson) -> None:
    """Trains the student, and keeps the epoch that agrees best with the teacher."""
    epochs = epochs_of(lesson)
    narrator.step(
        *("fit", *network_options(lesson), "--data.root", str(lesson.taught)),
        *("--trainer.logger.save_dir", str(lesson.work / "runs")),
        *("--checkpoint.dirpath", str(lesson.work)),
        *("--checkpoint.filename", lesson.checkpoint.stem),
        *("--trainer.max_epochs", str(epochs)),
        result=lambda _: "the student has learnt",
        epochs=epochs,
    )
