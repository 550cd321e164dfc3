"""Scans in memory, as a data module."""

from collections.abc import Sequence

from derain.cards.card import DataCard, load_card
from derain.datamodules.base import Loading, Part, ScanDataModule
from derain.errors import InputError
from derain.scan import Scan
from derain.sources.source import Frames, Source

Scans = Scan | Sequence[Scan] | Source


class InMemory(ScanDataModule):
    """Scans in memory, or of any source, for training, validation, test and prediction.

    Example:
        >>> import numpy as np
        >>> from lightning import Trainer
        >>> from derain.models.outdet import OutDet
        >>> points = np.random.default_rng(0).normal(size=(100, 4))
        >>> scan = Scan.of(points).with_label(np.resize([0, 110], 100))
        >>> data = InMemory(train=[scan] * 3, validation=[scan], test=[scan], card="wads")
        >>> model = OutDet()
        >>> quiet = {"logger": False, "enable_progress_bar": False, "enable_checkpointing": False}
        >>> trainer = Trainer(max_epochs=1, accelerator="cpu", **quiet)
        >>> trainer.fit(model, data)
        >>> (scores,) = trainer.test(model, data, verbose=False)
        >>> 0 <= scores["test/iou"] <= 1
        True
        >>> [[rain]] = trainer.predict(model, data)
        >>> rain.shape  # the probability of every point
        (100,)

    Args:
        train: The training scan or scans, in time order, with any labels they have.
        validation: The validation scans.
        test: The scans for test and prediction.
        card: Their data card: itself, the name of a packaged one, or a YAML file.
        loading: Options for batching scans.

    Raises:
        InputError: No such data card, or anything but scans.
    """

    def __init__(
        self,
        train: Scans = (),
        validation: Scans = (),
        test: Scans = (),
        *,
        card: DataCard | str,
        loading: Loading = Loading(),
    ) -> None:
        super().__init__(card if isinstance(card, DataCard) else load_card(card), loading)
        self.sources: dict[Part, Source] = {
            "train": _source(train),
            "validation": _source(validation),
            "test": _source(test),
        }

    def source(self, part: Part) -> Source:
        """The scans of a part.

        Raises:
            InputError: A part without scans.
        """
        name: Part = "test" if part == "predict" else part
        if not self.sources[name]:
            raise InputError(name, "there are no scans for it", f"Give scans: {name}=[...].")
        return self.sources[name]


def _source(scans: Scans) -> Source:
    if isinstance(scans, Source):
        return scans
    return Frames.of_scans([scans] if isinstance(scans, Scan) else scans)
