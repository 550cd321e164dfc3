"""Several data sets at once, each with its data card and its weight."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from torch.utils.data import DataLoader

from derain.cards.card import DataCard
from derain.cards.mixed import LabelMap, label_maps, mixed_card, with_pooled_statistics
from derain.datamodules.base import Loading, Part, ScanDataModule
from derain.datamodules.order import Draws, shared_out
from derain.errors import InputError
from derain.files.documents import Entry
from derain.learning.batch import Sample
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.sources.source import Frames, Source
from derain.sources.training_record import record_of_parts

# A name is a folder of predictions, a group of figures in a log and the beginning of classes.
_NAME = re.compile(r"\w[\w-]*")


class Mixture(ScanDataModule):
    """Several data sets as one: each epoch draws from all of them by weight.

    Each part keeps its own data card: a class of rain in one may be none in another. The mixture
    has the classes of all parts, named ``part: class``, so that scores are also logged by part.
    Inputs are normalised by the parts' statistics, pooled by weight.

    Each part's own ``loading`` determines how its files are read (columns, unit of intensity);
    batches, workers and augmentation are the mixture's. Points at one position are measured once
    if any part's card requires it.

    Example:
        >>> from derain.datamodules.folder import Folder
        >>> night = Folder(".", card="wads", train=["*.bin"], validation=["*.bin"])
        >>> day = Folder(".", card="wads", train=["*.bin"])
        >>> data = Mixture({"night": night, "day": day}, {"night": 3}, measured=["night"])
        >>> data.weights, [frame.key for frame in data.source("train")]
        ({'night': 3.0, 'day': 1.0}, ['night/scan', 'day/scan'])
        >>> [data.card.classes[number] for number in data.card.rain]
        ['night: falling-snow', 'day: falling-snow']

    Args:
        parts: Data modules, by a name for each.
        weights: In what proportion training draws scans from the parts, by their names; 1 by
            default.
        scans_per_epoch: Scans that an epoch of training draws; by default as many as all parts have
            together. A part with fewer scans than its share repeats them.
        measured: Names of the parts that are validated, tested and predicted; by default all.
        loading: Options for batching scans.

    Raises:
        InputError: No part with rain; a weight that is not greater than 0; the name of no
            part, or one with other characters than letters, digits, _ and -; a part that is a
            mixture itself; a scale of intensity for all parts.
    """

    def __init__(
        self,
        parts: dict[str, ScanDataModule],
        weights: dict[str, float] | None = None,
        scans_per_epoch: int | None = None,
        measured: list[str] | None = None,
        loading: Loading = Loading(),
    ) -> None:
        _check_parts(parts)
        weights = weights or {}
        measured = list(parts) if measured is None else measured
        for name in (*weights, *measured):
            if name not in parts:
                raise InputError(f"part '{name}'", "there is none", f"Parts: {', '.join(parts)}.")
        for name, weight in weights.items():
            Entry("weights", name, float(weight)).positive()  # also of NumPy
        if loading.intensity_scale != 1:
            raise InputError(
                "loading.intensity_scale", "would be that of all parts", "Give it to each part."
            )
        super().__init__(mixed_card(_cards(parts)), loading)
        self.parts = parts
        self.weights = {name: float(weights.get(name, 1)) for name in parts}
        self.scans_per_epoch = scans_per_epoch
        self.measured = measured

    @property
    def shares(self) -> list[float]:
        """Share of each part among the scans of an epoch, of 1 in all."""
        return [weight / sum(self.weights.values()) for weight in self.weights.values()]

    def prepare_data(self) -> None:
        """Prepares each part, such as by simulating its scans."""
        for part in self.parts.values():
            part.prepare_data()

    def source(self, part: Part) -> Source:
        """The scans of all parts, one part after the other.

        Raises:
            InputError: A part without scans for it.
        """
        names = self.parts if part == "train" else self.measured
        maps = label_maps(_cards(self.parts))
        return Frames(
            _of_part(frame, name, self.parts[name].loading, maps[name])
            for name in names
            for frame in self.parts[name].source(part)
        )

    def draws(self) -> Draws:
        """Number of scans of each part that an epoch draws.

        Raises:
            InputError: A part without training scans, or too light for a single one.
        """
        scans = {name: len(part.source("train")) for name, part in self.parts.items()}
        return Draws.by_weight(scans, self.weights, self.scans_per_epoch)

    def complete_card(self, columns: Sequence[str] = (), labelled: bool = True) -> None:
        """Measures what each part's card lacks on its training scans, and pools the statistics.

        Raises:
            InputError: A scan that cannot be read, or a part without one of the columns.
        """
        for part in self.parts.values():
            part.complete_card(columns, labelled)
        cards = _cards(self.parts)
        self.card = with_pooled_statistics(self.card, [*cards.values()], self.shares)

    def training_scans(
        self, most: int, columns: Sequence[str] | None = None, labelled: bool = True
    ) -> Iterator[Scan]:
        """Reads some of the training scans, shared by weight, at least one of each part.

        Raises:
            InputError: A scan or labels that cannot be read.
        """
        maps, numbers = label_maps(_cards(self.parts)), shared_out(most, self.shares)
        for (name, part), number in zip(self.parts.items(), numbers, strict=True):
            for scan in part.training_scans(max(number, 1), columns, labelled):
                label = scan.label
                yield scan if label is None else scan.with_label(maps[name](label, scan.name))

    def training_record(self) -> dict[str, tuple[str, ...]]:
        """The training scans, by the name of each part's data card."""
        return record_of_parts(
            (part.card.name, part.training_record()) for part in self.parts.values()
        )

    def train_dataloader(self) -> DataLoader[Sample | InputError]:
        """Training scans, drawn by weight, in a new order and newly augmented every epoch.

        Raises:
            InputError: Intensities that the model sees, in units that differ by the parts' cards.
        """
        units = {part.card.intensity_unit for part in self.parts.values()}
        units.discard(DataCard.intensity_unit)  # of a card that states none
        sees_intensity = self.task is not None and "intensity" in self.task.spec.channels
        if sees_intensity and len(units) > 1:
            raise InputError(
                "parts",
                f"their intensities differ in unit: {', '.join(sorted(units))}",
                "Leave intensity out of --model.channels, or convert it to one unit, by the cards "
                "and loading.intensity_scale of the parts.",
            )
        return super().train_dataloader()


def _cards(parts: Mapping[str, ScanDataModule]) -> dict[str, DataCard]:
    return {name: part.card for name, part in parts.items()}


def _of_part(frame: Frame, name: str, loading: Loading, label_map: LabelMap) -> Frame:
    """A part's frame as one of the mixture: no other part has its key or its sequence."""
    return replace(
        frame.with_intensity_times(loading.intensity_scale),
        key=f"{name}/{frame.key}",
        sequence=f"{name}/{frame.sequence}",
        label_map=label_map,
    )


def _check_parts(parts: Mapping[str, ScanDataModule]) -> None:
    for name, part in parts.items():
        if not _NAME.fullmatch(name):
            raise InputError(
                f"part '{name}'", "is no plain name", "Use letters, digits, _ and - alone."
            )
        if part.card.parts:
            raise InputError(f"part '{name}'", "is a mixture itself", "Name its parts.")
    if not any(part.card.rain for part in parts.values()):
        raise InputError("parts", "no class of them is rain", "Give a part with rain.")
