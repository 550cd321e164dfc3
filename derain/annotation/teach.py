"""Labels recordings by a method, and writes the data card of the labels."""

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from tqdm import tqdm

from derain.annotation.manifest import (
    CARD,
    LABELS,
    TAUGHT_MANIFEST,
    Manifest,
    TaughtScan,
    is_taught,
    label_path,
    parts_of,
)
from derain.cards.card import DataCard
from derain.errors import InputError
from derain.evaluation.answers import TEACHERS_ANSWERS
from derain.files.atomic import replacing
from derain.files.labels import write_labels
from derain.sources.file_frame import FileFrame
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.judging import Answer, Guard, judgements, unguarded
from derain.sources.method import Method
from derain.sources.sink import FolderSink, LabelSink
from derain.sources.source import Source

# Class ids of a teacher's answers.
TAUGHT_NOT_RAIN, TAUGHT_RAIN, TAUGHT_UNKNOWN = 0, 1, 255
TAUGHT_CLASSES = (TAUGHT_NOT_RAIN, TAUGHT_RAIN, TAUGHT_UNKNOWN)
TAUGHT_CARD = DataCard(
    "taught",
    classes=dict(zip(TAUGHT_CLASSES, TEACHERS_ANSWERS.values(), strict=True)),
    rain=(TAUGHT_RAIN,),
    unknown=(TAUGHT_UNKNOWN,),
)

# The folder of the labels until all of them are known.
UNFINISHED = ".unfinished"

# Called for each scan with the teacher's answer and the labels made of it, uint32 (N,).
Watch = Callable[[Answer, NDArray[np.uint32]], None]


def teach(
    method: Method,
    source: Source,
    out: Path,
    card: DataCard | None = None,
    guard: Guard = unguarded,
    watch: Watch = lambda answer, labels: None,
) -> Manifest:
    """Labels recordings: 0 is not rain, 1 rain, 255 not known.

    Labels of the scans are never read. Scans of which nothing is known are left out: they neither
    train nor measure a student. The folder stays unchanged until every scan is judged.

    Args:
        method: The teacher.
        source: Scans in files, in time order, one sequence after the other.
        out: Folder to write: a new one, or one of an earlier teaching. It gets the labels, their
            data card, and a manifest with the paths of the scans.
        card: Data card of the scans, from which the new one takes licence and unit.
        guard: Surrounds the work on each scan; a scan whose error it suppresses gets no labels.
        watch: Called for each scan as soon as it is judged, in order.

    Returns:
        The manifest.

    Raises:
        InputError: Scans that are in no files; a folder that holds something else, or in which the
            scans' own labels are; a scan that cannot be read or judged, unless the guard suppresses
            the error; no point of which anything is known.
    """
    refuse_to_overwrite(out, source)
    frames: list[FileFrame] = []
    with _unfinished(out) as folder:
        unlabelled = source.map(Frame.without_labels)
        shown = tqdm(unlabelled, desc="teaching", unit="scan", disable=None)
        for answer in judgements(method, shown, guard):
            frame, judgement, _ = answer
            assert isinstance(frame, FileFrame)  # refused above
            labels = labels_of(judgement)
            watch(answer, labels)
            if (labels != TAUGHT_UNKNOWN).any():
                write_labels(label_path(folder, frame.key), labels)
                frames.append(frame)
        if not frames:
            raise InputError(
                out,
                "nothing is written, for of no point it is known whether it is rain",
                "See whether the method suits the scans: some need several of one recording.",
            )
        manifest = Manifest(
            method.as_dict(),
            [
                TaughtScan(frame.key, frame.path, frame.sequence, frame.number, part)
                for frame, part in zip(frames, parts_of(frames), strict=True)
            ],
            frames[0].columns,
            frames[0].intensity_scale,
        )
        _put_in_place(folder, out, manifest, card)
    return manifest


def labels_of(judgement: Judgement) -> NDArray[np.uint32]:
    """The labels of each row of a judged scan, uint32 (N,), as they are written.

    Rows of which the method is not sure, which it did not see or which hold no return are unknown.
    """
    labels = np.where(judgement.rain, np.uint32(TAUGHT_RAIN), np.uint32(TAUGHT_NOT_RAIN))
    labels[~(judgement.answered & judgement.scan.valid)] = TAUGHT_UNKNOWN
    return labels


def write_card(path: Path, teacher: str, scans: DataCard | None) -> None:
    """Writes the data card of a teacher's labels; training measures its statistics.

    Args:
        path: The file.
        teacher: Name of the teacher.
        scans: Data card of the scans, which gives their licence, their unit, and whether points at
            one position count once; None where there is none.

    Raises:
        InputError: It cannot be written.
    """
    card: dict[str, Any] = {
        "name": f"{'scans' if scans is None else scans.name} taught by {teacher}",
        "classes": dict(TAUGHT_CARD.classes),
        "rain": [*TAUGHT_CARD.rain],
        "unknown": [*TAUGHT_CARD.unknown],
        "licence": f"derived from scans whose licence is {(scans or TAUGHT_CARD).licence}",
    }
    if scans is not None:
        card |= {
            "intensity_unit": scans.intensity_unit,
            "simulated": scans.simulated,
            "deduplicate": scans.deduplicate,
        }
    with replacing(path) as temporary:
        temporary.write_text(yaml.safe_dump(card, sort_keys=False, allow_unicode=True), "utf-8")


def refuse_to_overwrite(out: Path, source: Source) -> None:
    """Refuses, before any work, a folder or scans that cannot be taught.

    Raises:
        InputError: As for :func:`teach`.
    """
    for frame in source:
        if not isinstance(frame, FileFrame):
            raise InputError(
                frame.name, "is in no file, where it could be found again", "Write it to one."
            )
    # Refuses the places where the scans' own labels are or would be searched for.
    for sink in (FolderSink(out / LABELS, again=False), LabelSink(out / LABELS, again=False)):
        sink.refuse_clashes(source)
    if is_taught(out):
        return
    for name in (TAUGHT_MANIFEST, CARD, LABELS):
        if os.path.lexists(out / name):
            raise InputError(
                out / name, "is there already, and no teacher's", "Give --out another folder."
            )


def _put_in_place(folder: Path, out: Path, manifest: Manifest, card: DataCard | None) -> None:
    """Replaces the folder's contents; if it is interrupted, the manifest is marked unfinished."""
    Manifest(manifest.teacher, finished=False).write(out)
    shutil.rmtree(out / LABELS, ignore_errors=True)  # of an earlier teaching
    (folder / LABELS).rename(out / LABELS)
    write_card(out / CARD, Path(manifest.teacher["method"]).stem, card)
    manifest.write(out)


@contextmanager
def _unfinished(out: Path) -> Iterator[Path]:
    """A temporary hidden folder; at the end, a new and empty folder around it is removed, too."""
    folder = out / UNFINISHED
    there = out.is_dir()
    try:
        shutil.rmtree(folder, ignore_errors=True)  # left behind by a run that was killed
        folder.mkdir(parents=True)
        yield folder
    except BrokenPipeError:  # of the terminal, not of the folder
        raise
    except OSError as error:
        raise InputError(
            out,
            f"cannot be written ({error.strerror or error})",
            "Choose a folder that is writable and has room.",
        ) from error
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        if not there:
            with suppress(OSError):
                out.rmdir()
