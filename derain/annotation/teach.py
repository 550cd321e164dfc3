"""Labels recordings by a method, and writes the data card of the labels."""

import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import yaml
from tqdm import tqdm

from derain.annotation.labelling import TAUGHT_CARD, LabelledScan, Labelling
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
from derain.files.atomic import replacing
from derain.files.labels import LABEL
from derain.jobs.job import FOLDER
from derain.jobs.running import Submits, Task, completed, run
from derain.sources.file_frame import FileFrame
from derain.sources.frame import Frame
from derain.sources.judging import Guard, unguarded
from derain.sources.method import Method
from derain.sources.sink import FolderSink, LabelSink
from derain.sources.source import Source
from derain.sources.unit_judging import Placing
from derain.sources.units import Division, units_of, whole

# The folder of the labels until all of them are known.
UNFINISHED = ".unfinished"

# Receives each labelled scan.
Watch = Callable[[LabelledScan], None]


def teach(
    method: Method,
    source: Source,
    out: Path,
    card: DataCard | None = None,
    guard: Guard = unguarded,
    watch: Watch = lambda scan: None,
    division: Division | None = None,
    executor: Submits | None = None,
    placing: Placing | None = None,
) -> Manifest:
    """Labels recordings: 0 is not rain, 1 rain, 255 not known.

    Labels of the scans never change the result. Scans of which nothing is known are left out: they
    neither train nor measure a student. The folder stays unchanged until every scan is judged, but
    for the hidden folder in which the labels wait where records are kept.

    Args:
        method: The teacher.
        source: Scans in files, in time order, one sequence after the other.
        out: Folder to write: a new one, or one of an earlier teaching. It gets the labels, their
            data card, and a manifest with the paths of the scans.
        card: Data card of the scans, from which the new one takes licence and unit.
        guard: Surrounds the error of each scan; a scan whose error it suppresses gets no labels.
        watch: Called for each scan as soon as it is judged, in order.
        division: How the scans are divided into units. Where there are more scans than a block has,
            a record of each unit is kept in the folder, by which a teaching that was stopped goes
            on. None keeps no records.
        executor: Does the units: an executor of :mod:`concurrent.futures` or the like, whose
            processes find all files by the same paths. None does them in this process.
        placing: Finds where the scans of whole recordings were taken; see
            :func:`derain.sources.cleaning.clean`.

    Returns:
        The manifest. It is not finished, and nothing is in its place, while other shards of the
        units are to be done.

    Raises:
        InputError: Scans that are in no files; a folder that holds something else, or in which the
            scans' own labels are; a scan that cannot be read or judged, unless the guard suppresses
            the error; no point of which anything is known; records of other options in the folder;
            an executor that has ended.
    """
    refuse_to_overwrite(out, source)
    fingerprint = method.fingerprint()
    if division is not None and division.keeps_records(source, out):
        place = out.absolute()  # other processes may work in another folder
        # The labels of all scans stay there, and are linked to where they belong.
        work = Labelling(method, fingerprint, placing, place / FOLDER, card)
        options = work.options("teach", source, division.block)
        options["card"] = None if card is None else card.name
        block = division.block if placing is None else len(source)  # whole recordings
        units = units_of(source, method, block)
        job, shard = division.begin(place, options, units)
        task = Task(job, work)
        results = (each.result for each in run(task, shard, executor))
        frames = _known(results, sum(len(unit.frames) for unit in shard), guard, watch)
        if division.shard is not None:
            scans = completed(task, units)
            if scans is None:
                return Manifest(method.as_dict(), finished=False)
            frames = [scan.frame for scan in scans if scan.is_known]
        return _finish(work, out, frames)
    with _unfinished(out) as folder:
        work = Labelling(method, fingerprint, placing, folder, card)
        frames = _known(work.do(whole(source)), len(source), guard, watch)
        return _finish(work, out, frames)


def _known(scans: Iterator[LabelledScan], total: int, guard: Guard, watch: Watch) -> list[Frame]:
    """The frames of which something is known, after all scans are labelled."""
    frames: list[Frame] = []
    for scan in tqdm(scans, total=total, desc="teaching", unit="scan", disable=None):
        if scan.error is not None:
            with guard(scan.frame):
                raise scan.error
        else:
            watch(scan)
            if scan.is_known:
                frames.append(scan.frame)
    return frames


def _finish(work: Labelling, out: Path, known: Sequence[Frame]) -> Manifest:
    """Puts the labels, their card and the manifest in their place.

    Raises:
        InputError: Nothing is known of any scan.
    """
    frames = [frame for frame in known if isinstance(frame, FileFrame)]  # all are in files
    if not frames:
        raise InputError(
            out,
            "nothing is written, for of no point it is known whether it is rain",
            "See whether the method suits the scans: some need several of one recording.",
        )
    manifest = Manifest(
        work.method.as_dict(),
        [
            TaughtScan(frame.key, frame.path, frame.sequence, frame.number, part)
            for frame, part in zip(frames, parts_of(frames), strict=True)
        ],
        frames[0].columns,
        frames[0].intensity_scale,
    )
    _put_in_place(work.folder, out, manifest, work.card)
    return manifest


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
    """Replaces the folder's contents; if it is interrupted, the manifest is marked unfinished.

    Two commands that do the last shards may do it at once.
    """
    Manifest(manifest.teacher, finished=False).write(out)
    labels = {label_path(out, scan.key): label_path(folder, scan.key) for scan in manifest.scans}
    for earlier in (out / LABELS).rglob(f"*{LABEL}"):
        if earlier not in labels:
            earlier.unlink(missing_ok=True)
    for target, written in labels.items():
        with replacing(target) as temporary:
            _link(written, temporary)
    write_card(out / CARD, Path(manifest.teacher["method"]).stem, card)
    manifest.write(out)


def _link(file: Path, name: Path) -> None:
    """Gives a file another name."""
    try:
        os.link(file, name)
    except OSError:  # a file system without links
        shutil.copyfile(file, name)


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
