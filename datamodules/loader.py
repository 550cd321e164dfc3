"""Loaders of batches, with or without a data module around them."""

from torch.utils.data import DataLoader, Sampler

from derain.datamodules.draws import DrawnOrder, Draws
from derain.datamodules.kept import MEGABYTE
from derain.datamodules.loading import Loading, Part
from derain.datamodules.needed_labels import with_needed_labels
from derain.datamodules.order import MeasuringOrder, Pick, TrainingOrder
from derain.datamodules.scan_dataset import LateLoader, ScanDataset, packed
from derain.errors import InputError
from derain.learning.batch import Sample
from derain.learning.seeds import run_seed
from derain.learning.task import Task
from derain.sources.reader import FrameReader
from derain.sources.source import Source


def scan_loader(
    source: Source,
    part: Part,
    task: Task,
    loading: Loading = Loading(),
    processes: int = 1,
    process: int = 0,
    draws: Draws | None = None,
) -> DataLoader[Sample | InputError]:
    """A loader of :class:`~derain.learning.batch.Batch`, as a trainer or a plain loop takes it.

    Example:
        >>> import numpy as np
        >>> from derain.datamodules.in_memory import InMemory
        >>> from derain.learning.task import agree
        >>> from derain.models.outdet import OutDet
        >>> from derain.scan import Scan
        >>> points = np.random.default_rng(0).normal(size=(100, 4))
        >>> scan = Scan.of(points).with_label(np.resize([0, 110], 100))
        >>> data = InMemory(train=[scan] * 3, card="wads")
        >>> task = agree(OutDet(), data)
        >>> loader = scan_loader(data.source("train"), "train", task, Loading(batch_size=2))
        >>> [batch.cells for batch in loader]
        [[100, 100], [100]]

    Args:
        source: The scans, with their labels where they have any.
        part: What they are read for. Training has an order and an augmentation of its own for
            every epoch, which the sampler is told by ``set_epoch``; a trainer does. Everything
            else comes in order and as it is; for prediction without labels, and every row of it.
        task: What was agreed with the model.
        loading: How the scans are read and batched. Of files, the source knows the columns.
        processes: How many processes share the scans.
        process: Which of them this is.
        draws: How many of which scans are drawn for an epoch of training; None draws each once.

    Raises:
        InputError: Labels missing where they are needed; or a network that sees several scans, of
            which the augmentation would change one.
    """
    view = task.make_view(threads=1 if loading.workers else 0)
    if part == "train" and loading.augmentation.moves_the_sensor and not view.window.is_one_scan:
        raise InputError(
            "augmentation",
            "would turn a scan and leave those around it, which the network sees too",
            "Set rotation_probability and mirror_probability to 0.",
        )
    reader = FrameReader(task.card, loading.intensity_scale, task.columns)
    once = loading.counts_once(task.card)
    augmented = part == "train" and loading.augmentation.changes_anything
    # Tests and predictions ask for each scan once.
    room = loading.kept_megabytes * MEGABYTE if part in ("train", "validation") else 0
    dataset = ScanDataset(
        # Of frames to predict, whoever writes beside them has to know where their labels are.
        source if part == "predict" else with_needed_labels(source, part, task.reads_labels),
        {
            # Jitter would pull equal points apart, which the view takes for one in deployment.
            "train": reader.read_distinct,
            "predict": reader.read_unlabelled,
        }.get(part, reader.read_distinct if once else reader.read),
        view,
        reader,
        loading.augmentation if augmented else None,
        run_seed(),
        room // max(loading.workers, 1),
    )
    return LateLoader(
        dataset,
        batch_size=loading.batch_size,
        sampler=_order(dataset, part, loading.batch_size, processes, process, draws),
        num_workers=loading.workers,
        persistent_workers=loading.workers > 0,
        collate_fn=packed,
    )


def _order(
    dataset: ScanDataset,
    part: Part,
    batch_size: int,
    processes: int,
    process: int,
    draws: Draws | None,
) -> Sampler[Pick]:
    if part != "train":
        return MeasuringOrder(dataset, batch_size, processes, process)
    if draws is not None:
        return DrawnOrder(draws, dataset.seed, processes, process)
    return TrainingOrder(dataset, dataset.seed, processes, process)
