"""Labelled scans by part, and how they are read: what measuring needs, and training too.

Nothing here loads torch.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from derain.annotation.manifest import FEWEST_SCANS, HELD_OUT_PART, TRAINING_PART, Manifest
from derain.cards.card import DataCard
from derain.cards.layout import Layout
from derain.datamodules.augmentation import Augmentation
from derain.errors import InputError
from derain.files import DEFAULT_COLUMNS
from derain.learning.task import Task
from derain.sources.folders import frames_of, relative_keys
from derain.sources.reader import FrameReader
from derain.sources.search import listed_scans
from derain.sources.source import Source

Part = Literal["train", "validation", "test", "predict"]


@dataclass(frozen=True)
class Loading:
    """Options for reading and batching scans.

    Attributes:
        batch_size: Scans in a batch.
        workers: Processes that read and view scans; 0 does it in the training process.
        columns: Names of the columns of files that do not name them.
        intensity_scale: Factor from the scans' intensities to the unit of the data card, e.g. 255.
        deduplicate: True if points at one position are measured once; None follows the data card.
            Predictions cover every row in any case.
        augmentation: Augmentation of training scans.
        cache_mb: Memory in which training scans are kept from epoch to epoch, so that they
            are not read again, and as much for validation scans. Workers divide it among them.

    Raises:
        InputError: Fewer scans, processes or megabytes than there can be.
    """

    batch_size: int = 1
    workers: int = 0
    columns: tuple[str, ...] = DEFAULT_COLUMNS
    intensity_scale: float = 1.0
    deduplicate: bool | None = None
    augmentation: Augmentation = field(default_factory=Augmentation)
    cache_mb: int = 512

    def __post_init__(self) -> None:
        for name, fewest in {"batch_size": 1, "workers": 0, "cache_mb": 0}.items():
            value = getattr(self, name)
            if value < fewest:
                raise InputError(name, f"{value} is too few", f"Give {fewest} or more.")

    def reader(self, card: DataCard, columns: Sequence[str] | None) -> FrameReader:
        """Reads scans by these options.

        Args:
            card: Their data card.
            columns: Columns to keep, as of :class:`~derain.sources.reader.FrameReader`.
        """
        distinct = card.deduplicate if self.deduplicate is None else self.deduplicate
        return FrameReader(card, self.intensity_scale, columns, distinct)


class ScanData(ABC):
    """Labelled scans for training, validation and test.

    Args:
        card: Data card of the scans.
        loading: Options for reading scans.

    Attributes:
        task: What a model and these data have agreed on before training; None where there is no
            model, or none yet.
    """

    task: Task | None = None

    def __init__(self, card: DataCard, loading: Loading) -> None:
        self.card = card
        self.loading = loading

    @abstractmethod
    def source(self, part: Part) -> Source:
        """The scans of a part of the data, in order, and where their labels should be.

        Raises:
            InputError: Missing folders or scans.
        """

    def frames(self, part: Part) -> Source:
        """The scans of a part of the data, in order, each with the labels that are read there.

        Raises:
            InputError: Missing folders or scans, or labels missing where they are needed.
        """
        reads_labels = self.task is None or self.task.reads_labels
        return with_needed_labels(self.source(part), part, reads_labels)

    @property
    def reader(self) -> FrameReader:
        """Reads scans with their labels; for a model, with the columns that it sees."""
        columns = None if self.task is None else self.task.columns
        return self.loading.reader(self.card, columns)


def with_needed_labels(source: Source, part: Part, reads_labels: bool) -> Source:
    """The frames of a part, each with the labels that are read there.

    Prediction reads none, nor does the training of a model that does not learn from labels. The
    validation of such a model reads the labels it finds: they measure and choose nothing.

    Args:
        source: The frames, with the labels they have.
        part: The part.
        reads_labels: True if the model learns from labels.

    Raises:
        InputError: Labels missing where they are needed.
    """
    if part == "predict" or (part == "train" and not reads_labels):
        return source.map(lambda frame: frame.without_labels())
    if part == "validation" and not reads_labels:
        return source.map(lambda frame: frame if frame.has_labels else frame.without_labels())
    for frame in source:
        frame.require_labels()
    return source


def split_source(
    root: Path,
    layout: Layout,
    split: Mapping[str, Sequence[str]],
    columns: Sequence[str],
    part: Part,
) -> Source:
    """The scans of the sequences that a split assigns to a part; prediction has those of the test.

    Args:
        root: Folder of the data set.
        layout: Names of its folders.
        split: Sequences of ``train``, ``validation`` and ``test``.
        columns: Names of the columns of files that do not name them.
        part: The part.

    Raises:
        InputError: A part without sequences, or a missing sequence or scan folder.
    """
    sequences = split.get("test" if part == "predict" else part, ())
    if not sequences:
        raise InputError(
            root,
            f"no sequences are named for {part}",
            "Simulate more of them; or give `derain fit` a --data.split, and other commands "
            "another --part.",
        )
    folders = [root / layout.sequences / name for name in sequences]
    for folder in folders:
        if not (folder / layout.scans).is_dir():
            raise InputError(
                folder / layout.scans,
                f"no such folder, though the split names sequence {folder.name}",
                "Check the root, and the layout of its data card. If only some sequences are "
                "there, give `derain fit` a --data.split, and other commands the folders of scans.",
            )
    scans = listed_scans(folder / layout.scans for folder in folders)
    return frames_of(scans, layout.label_of, columns, relative_keys(scans))


def taught_source(root: Path, manifest: Manifest, part: Part) -> Source:
    """The scans of a part that a teacher labelled: the held-out ones for every part but ``train``.

    Args:
        root: The folder that ``derain teach`` wrote.
        manifest: Its manifest.
        part: The part.

    Raises:
        InputError: No scan was held out.
    """
    frames = manifest.frames(root, TRAINING_PART if part == "train" else HELD_OUT_PART)
    if not len(frames):
        raise InputError(
            root,
            f"none of its labelled scans is for {part}",
            f"Of a sequence with {FEWEST_SCANS} or more labelled scans the last ones are held "
            "out: see what `derain teach` warned of.",
        )
    return frames
