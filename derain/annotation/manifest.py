"""The manifest of taught labels: the teacher, and the scans with their paths.

Scans are not copied. Relative paths start from the folder of the labels, so that both can be moved
together.
"""

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, Self

import yaml

from derain import __version__
from derain.bags.names import split
from derain.errors import InputError
from derain.files import DEFAULT_COLUMNS
from derain.files.atomic import replacing
from derain.files.documents import Entry, shown
from derain.files.labels import LABEL
from derain.files.reading import is_file, reading
from derain.sources.bag_frame import bag_frame, clouds_at
from derain.sources.file_frame import FileFrame
from derain.sources.frame import Frame
from derain.sources.records import Records
from derain.sources.source import Frames

TAUGHT_MANIFEST, CARD, LABELS = "taught.yaml", "card.yaml", "labels"

# The value of ``made_by``, which distinguishes the manifest from any other YAML file.
TEACHING = "derain.teaching"

# In bytes. The entry of a scan takes about a hundred bytes and eleven values: 90,000 entries fit.
LARGEST_TAUGHT = 2**24

# More scans than any recording has, and a larger factor than between any units of intensity.
HIGHEST_NUMBER, LARGEST_SCALE = 10**9, 1e9

# The part of a scan: the last scans of every sequence are held out.
TaughtPart = Literal["train", "validation"]
TRAINING_PART: TaughtPart = "train"
HELD_OUT_PART: TaughtPart = "validation"
TAUGHT_PARTS: tuple[TaughtPart, ...] = (TRAINING_PART, HELD_OUT_PART)

# One scan in ONE_IN is held out, and at least one of a sequence of FEWEST_SCANS or more.
ONE_IN, FEWEST_SCANS = 5, 3


@dataclass(frozen=True)
class TaughtScan:
    """One scan with labels of a teacher.

    Attributes:
        key: Its labels are ``labels/<key>.label``.
        scan: Its file.
        sequence: Name of its sequence.
        number: Its number in the sequence, from 0.
        part: Whether it is for training or held out.
    """

    key: str
    scan: Path
    sequence: str
    number: int
    part: TaughtPart


@dataclass(frozen=True)
class Manifest:
    """The contents of a folder of taught labels.

    Attributes:
        teacher: Its name under ``method``, and its parameters.
        scans: The scans, in time order, one sequence after the other.
        columns: Names of the columns of files that do not name them.
        intensity_scale: Factor from the scans' intensities to the unit that the teacher read.
        finished: True if all labels are there.
    """

    teacher: Mapping[str, Any]
    scans: Sequence[TaughtScan] = ()
    columns: tuple[str, ...] = DEFAULT_COLUMNS
    intensity_scale: float = 1.0
    finished: bool = True

    @classmethod
    def read(cls, root: Path) -> Self:
        """Reads and checks the manifest of a folder.

        Raises:
            InputError: No manifest, a damaged one, or one of an unfinished teaching.
        """
        path = root / TAUGHT_MANIFEST
        if not is_file(path):
            remedy = "Give a folder that `derain teach` wrote."
            raise InputError(root, f"has no {TAUGHT_MANIFEST}", remedy)
        entry = Entry.of_yaml(path, LARGEST_TAUGHT)
        if not (isinstance(entry.value, dict) and entry.value.get("made_by") == TEACHING):
            raise entry.fault("`derain teach` did not write it", "Give a folder that it wrote.")
        home = Path(os.path.realpath(root))
        fields = {
            "teacher": lambda item: item.each(lambda part: part.value),
            "columns": Entry.texts,
            "intensity_scale": lambda item: item.within(1 / LARGEST_SCALE, LARGEST_SCALE),
            "finished": Entry.truth,
            "scans": lambda item: tuple(_scan_of(part, home) for part in item.items()),
        }
        origin = {"made_by": Entry.text, "derain": Entry.text}
        content = entry.record({**origin, **fields}, required=fields)
        manifest = cls(**{key: content[key] for key in fields})
        if not manifest.finished:
            raise entry.fault("its labels are not complete", "Run the same `derain teach` again.")
        if len({scan.key for scan in manifest.scans}) < len(manifest.scans):
            raise entry.fault("two scans have one key", "Teach it again.")
        return manifest

    def write(self, root: Path) -> None:
        """Writes the manifest.

        Raises:
            InputError: It cannot be written.
        """
        home = Path(os.path.realpath(root))
        content = {
            "made_by": TEACHING,
            "derain": __version__,
            # A copy, because YAML would write an object that occurs twice as an alias.
            "teacher": json.loads(json.dumps(dict(self.teacher))),
            "columns": list(self.columns),
            "intensity_scale": self.intensity_scale,
            "finished": self.finished,
            "scans": [
                {**vars(scan), "scan": _relative_path(home, scan.scan)} for scan in self.scans
            ],
        }
        with replacing(root / TAUGHT_MANIFEST) as temporary:
            text = yaml.safe_dump(content, sort_keys=False, width=10**6, default_flow_style=None)
            temporary.write_text(text, "utf-8")

    def frames(self, root: Path, part: TaughtPart) -> Frames:
        """The scans of a part, in order, each with its taught labels."""
        folders = {scan.scan.parent for scan in self.scans}
        records = {folder: Records(folder) for folder in folders}
        clouds = {folder: clouds_at(folder)[0] for folder in folders if split(folder) is not None}

        def frame_of(scan: TaughtScan) -> FileFrame:
            folder = scan.scan.parent
            frame = (
                bag_frame(clouds[folder], scan.number, scan.key)
                if folder in clouds
                else FileFrame(
                    key=scan.key,
                    number=scan.number,
                    path=scan.scan,
                    columns=self.columns,
                    records=records[folder],
                )
            )
            return replace(
                frame,
                sequence=scan.sequence,
                label_path=label_path(root, scan.key),
                intensity_scale=self.intensity_scale,
            )

        return Frames(frame_of(scan) for scan in self.scans if scan.part == part)


def parts_of(frames: Sequence[Frame]) -> Iterator[TaughtPart]:
    """The part of each frame: the end of each sequence is held out.

    Neighbouring scans show nearly the same: a held-out scan between two training scans would not
    be new to the student.

    Args:
        frames: Frames in time order, one sequence after the other, perhaps with some missing.
    """
    sequence: list[Frame] = []
    for frame in frames:
        if sequence and not _is_later(frame, sequence[-1]):
            yield from _parts(len(sequence))
            sequence = []
        sequence.append(frame)
    yield from _parts(len(sequence))


def is_taught(root: Path) -> bool:
    """True if a folder holds taught labels, complete or not."""
    path, head = root / TAUGHT_MANIFEST, f"made_by: {TEACHING}\n".encode()
    if not is_file(path):
        return False
    with reading(path), path.open("rb") as file:
        return file.read(len(head)) == head


def label_path(root: Path, key: str) -> Path:
    """Path of the labels of a scan."""
    return root / LABELS / f"{key}{LABEL}"


def _is_later(frame: Frame, other: Frame) -> bool:
    """True if a frame is later in the same sequence; two sequences may have one name."""
    return frame.sequence == other.sequence and frame.number > other.number


def _parts(scans: int) -> list[TaughtPart]:
    held_out = max(scans // ONE_IN, 1) if scans >= FEWEST_SCANS else 0
    return [TRAINING_PART] * (scans - held_out) + [HELD_OUT_PART] * held_out


def _relative_path(home: Path, scan: Path) -> str:
    """The path of a scan relative to a folder."""
    return os.path.relpath(Path(os.path.realpath(scan.parent)) / scan.name, home)


def _scan_of(entry: Entry, home: Path) -> TaughtScan:
    fields = {
        "key": _key,
        "scan": lambda item: Path(os.path.normpath(home / item.text())),
        "sequence": Entry.text,
        "number": lambda item: item.whole(0, HIGHEST_NUMBER),
        "part": lambda item: item.one_of(TAUGHT_PARTS),
    }
    return TaughtScan(**entry.record(fields, required=fields))


def _key(entry: Entry) -> str:
    """A relative path that stays in the folder of labels."""
    key = entry.text()
    if not key or Path(key).is_absolute() or {"..", ""} & set(key.split("/")):
        raise entry.fault(f"{shown(key)} is not the name of a scan", "Teach it again.")
    return key
