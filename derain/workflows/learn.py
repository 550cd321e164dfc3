"""Learns to take out rain from an unlabelled recording: teacher, network, ONNX file, report."""

import shlex
import shutil
from collections.abc import Sequence
from pathlib import Path

from derain.annotation.manifest import FEWEST_SCANS
from derain.annotation.teach import TeachResults, teach
from derain.datamodules.taught import Taught
from derain.errors import InputError, counted
from derain.export.methods import PERSISTENCE, load_method, named_method, over_recording
from derain.export.onnx_file import export
from derain.export.runtime import Derainer
from derain.files.atomic import require_writable, write_text
from derain.models.checkpoint import load_model
from derain.recordings.posed import STANDING, with_poses
from derain.sources.folders import named_frames
from derain.sources.judging import Failures
from derain.sources.method import Method
from derain.sources.source import Source
from derain.system.memory import keep_freed_memory
from derain.system.notices import recorded_warnings, warn
from derain.workflows.evaluation import beside_persistence, evaluate_student
from derain.workflows.fit import fit, fit_options
from derain.workflows.learn_config import LearnConfig, Student, student_of
from derain.workflows.learn_report import LEAST_RAIN, LearnResults, write_report
from derain.workflows.progress import Show, Steps, show_nothing

# A folder with this file may be cleared by a second run.
MARK = "learning.txt"

# Teaching, training, export and measuring.
LEARN_STEPS = 4


def learn(config: LearnConfig, show: Show = show_nothing) -> LearnResults:
    """Labels a recording by a teacher, trains a network on the labels, exports and measures it.

    Example:
        >>> drive = LearnConfig([Path("drive")], Path("model.onnx"))
        >>> learn(drive, print).agreement.agreement.iou  # doctest: +SKIP
        0.93
        >>> learn(LearnConfig([Path("scan.bin")], Path("model.onnx")))  # doctest: +ELLIPSIS
        Traceback (most recent call last):
            ...
        derain.errors.InputError: scan.bin: 1 scan: too few for training ...

    Args:
        config: Options of the run.
        show: Receives a line for each step, and one for its result.

    Returns:
        How good teacher and student are; the report holds the same.

    Raises:
        InputError: Too few scans, or too few that can be labelled; a folder that holds something
            else; nothing to be learnt; or what a step raises. A model of an earlier run stays
            unless the export has replaced it.
    """
    source = named_frames(config.recordings, config.columns, topic=config.topic)
    if len(source) < FEWEST_SCANS:
        raise InputError(
            config.recordings[0],
            f"{counted(len(source), 'scan')}: too few for training and validation",
            f"Record {FEWEST_SCANS} or more, one after the other; twenty are enough.",
        )
    student = student_of(config, source)
    require_writable(config.out)
    keep_freed_memory()
    with recorded_warnings() as warnings:
        teacher = over_recording(load_method(*named_method(config.teacher)))
        found = named_frames(
            config.recordings, config.columns, labelled=True, recordings=True, topic=config.topic
        )
        recording = with_poses(found, config.poses)
        _clear(config.work)  # after all that may be mistyped is read
        scans = f"{len(source):,} scans to learn from"
        show(f"{scans}. Everything but the model goes to {config.work}/")
        if student.blind and not config.blind and student.start is None:
            show("The scans have no intensities: the network is trained without them.")
        steps = Steps(show, LEARN_STEPS)
        taught = _teach(config, teacher, recording, steps, warnings)
        data = Taught(str(config.taught))
        # Scans suit persistence, another teacher, where this one sees several at a time.
        is_compared = config.teacher != PERSISTENCE and not teacher.window.is_one_scan
        results = LearnResults(
            title=", ".join(map(str, config.recordings)),
            teacher=config.teacher,
            student=str(student),
            model=config.out,
            path=config.work / "report.md",
            taught=taught.answers,
            trained_on=len(taught.manifest.scans) - taught.held_out,
            held_out=taught.held_out,
            persistence=beside_persistence(data, recording) if is_compared else None,
            stood=config.poses == STANDING,
            sees_intensity=student.sees_unit,
            warnings=warnings,
            commands=commands(config, student),
        )
        write_report(results)  # the teacher's labels are worth a look, whatever follows
        _refuse_clean(results)
        steps.begin(f"Training: {student}, {counted(student.epochs, 'epoch')}")
        trained = fit(student.config, _settings(config, student), quiet=True)
        scored = trained.iou is not None
        steps.end(f"IoU {trained.iou:.3f} on held-out scans, last epoch" if scored else "trained")
        export_checkpoint(config.checkpoint, config.out, steps)
    steps.begin("Measuring: the model on held-out scans")
    evaluate_student(results, data, Derainer(config.out))
    write_report(results)
    steps.end(f"report: {results.path}")
    show(f"Done in {steps.elapsed}")
    return results


def commands(config: LearnConfig, student: Student) -> list[str]:
    """Commands that repeat the steps of :func:`learn`.

    Args:
        config: Options of the run.
        student: The network that learns.
    """
    scans = [*map(str, config.recordings)]
    topic = () if config.topic is None else ("--topic", config.topic)
    reading = (*topic, "--columns", ",".join(config.columns))
    taught = str(config.taught)
    poses = () if config.poses is None else ("--poses", config.poses)
    steps = [
        ("teach", config.teacher, *scans, "--out", taught, *poses, *reading),
        ("fit", *fit_options(student.config, _settings(config, student))),
        ("export", str(config.checkpoint), "--out", str(config.out)),
    ]
    return [f"derain {shlex.join(words)}" for words in steps]


def _settings(config: LearnConfig, student: Student) -> dict[str, object]:
    """Settings of the training, which keeps the epoch that agrees best with the teacher."""
    return {
        **student.settings,
        "data.root": config.taught,
        "trainer.logger.save_dir": config.work / "runs",
        "checkpoint.dirpath": config.work,
        "checkpoint.filename": config.checkpoint.stem,
        "trainer.max_epochs": student.epochs,
    }


def _clear(work: Path) -> None:
    """Empties the folder of everything but the model.

    Raises:
        InputError: It holds something that no earlier run has written.
    """
    mark = work / MARK
    if work.is_dir() and any(work.iterdir()) and not mark.is_file():
        raise InputError(work, "holds files that no earlier run wrote", "Give another --work.")
    require_writable(mark)
    for left in work.iterdir():
        shutil.rmtree(left) if left.is_dir() and not left.is_symlink() else left.unlink()
    write_text(mark, "Written by derain learn, which clears this folder.\n")


def _teach(
    config: LearnConfig, teacher: Method, recording: Source, steps: Steps, warnings: Sequence[str]
) -> TeachResults:
    """Has the teacher label the scans.

    Raises:
        InputError: So few scans are labelled that none of them is held out.
    """
    steps.begin(f"Teaching: {config.teacher} labels the scans")
    # The error of one scan is a warning; the others go on.
    guard = Failures(lambda error: warn(str(error))).skipping_failures
    results = teach(teacher, recording, config.taught, guard=guard)
    labelled = len(results.manifest.scans)
    if not results.held_out:
        reason = f": {warnings[0]}" if warnings else ""
        raise InputError(
            config.recordings[0],
            f"only {labelled} of {len(recording)} scans could be labelled, and a recording needs "
            f"{FEWEST_SCANS}{reason}",
            "Record scans that overlap.",
        )
    steps.end(f"{labelled:,} scans labelled")
    return results


def _refuse_clean(results: LearnResults) -> None:
    """Refuses to train on a recording in which the teacher has found nothing to learn.

    Raises:
        InputError: No sure point, or hardly any rain among the sure points.
    """
    taught = results.taught
    if taught.shares[2] == 1 or not taught.points:
        raise InputError(
            results.title,
            f"{results.teacher} is sure of no point, so that there is nothing to learn",
            f"See {results.path}: the scans have to follow one another, and to overlap.",
        )
    if taught.rain_among_known < LEAST_RAIN:
        raise InputError(
            results.title,
            f"hardly any rain was found ({taught.rain_among_known:.3%} of the points that "
            f"{results.teacher} is sure of): it seems to be clean",
            f"Record in rain, or take another --teacher. What was found: {results.path}.",
        )


def export_checkpoint(checkpoint: Path, out: Path, steps: Steps) -> None:
    """Exports a checkpoint as a step of a longer work.

    Args:
        checkpoint: The checkpoint.
        out: The ONNX file.
        steps: Shows the step.

    Raises:
        InputError: As for :func:`derain.export.onnx_file.export`.
    """
    steps.begin(f"Export: {out}")
    proof = export(load_model(checkpoint), out)
    steps.end(
        f"{out.stat().st_size:,} bytes; beside PyTorch the largest logit difference is "
        f"{proof.worst.difference:.1e}, {proof.flipped:,} labels differ"
    )
