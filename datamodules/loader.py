"""Loaders of batches, with or without a data module."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from torch.utils.data import DataLoader, Sampler

from derain.datamodules.order import Draws, MeasuringOrder, Pick, TrainingOrder
from derain.datamodules.scan_data import Loading, Part, with_needed_labels
from derain.datamodules.scan_dataset import MEGABYTE, ScanDataset
from derain.errors import InputError
from derain.learning.batch import VIEW, Batch, Sample, summed_times
from derain.learning.seeds import run_seed
from derain.learning.task import Task
from derain.sources.source import Source
from derain.system.stopwatch import Stopwatch


def scan_loader(
    source: Source,
    part: Part,
    task: Task,
    loading: Loading = Loading(),
    processes: int = 1,
    process: int = 0,
    draws: Draws | None = None,
) -> DataLoader[Sample | InputError]:
    """A loader of :class:`~derain.learning.batch.Batch`, for a trainer or a plain loop.

    Example:
        >>> import numpy as np
        >>> from derain.datamodules.in_memory import InMemory
        >>> from derain.learning.task import agree_on_task
        >>> from derain.models.outdet import OutDet
        >>> from derain.scan import Scan
        >>> points = np.random.default_rng(0).normal(size=(100, 4))
        >>> scan = Scan.of(points).with_label(np.resize([0, 110], 100))
        >>> data = InMemory(train=[scan] * 3, card="wads")
        >>> task = agree_on_task(OutDet(), data)
        >>> loader = scan_loader(data.source("train"), "train", task, Loading(batch_size=2))
        >>> [batch.cells for batch in loader]
        [[100, 100], [100]]

    Args:
        source: The scans, with their labels where they have any.
        part: Part that they are read for. Training has a new order and augmentation every epoch:
            call the sampler's ``set_epoch``, as a trainer does. The other parts are read in order
            and unchanged; for prediction without labels and with all rows.
        task: Agreement of model and data.
        loading: Options for batching scans. The source has the columns of files.
        processes: Number of processes that share the scans.
        process: Number of this process.
        draws: The scans that an epoch of training draws; None draws each once.

    Raises:
        InputError: Labels missing where they are needed.
    """
    view = task.spec.make_view(threads=1 if loading.workers else 0)
    reader = loading.reader(task.card, task.columns)
    augmented = part == "train" and loading.augmentation.changes_anything
    # Tests and predictions read each scan once.
    room = loading.cache_mb * MEGABYTE if part in ("train", "validation") else 0
    dataset = ScanDataset(
        # Frames to predict keep the path of their labels: predictions must not overwrite them.
        source if part == "predict" else with_needed_labels(source, part, task.reads_labels),
        {
            # Jitter would separate points at one position, which the view merges in deployment.
            "train": reader.read_distinct,
            "predict": reader.read_unlabelled,
        }.get(part, reader.read_measured),
        view,
        reader,
        loading.augmentation if augmented else None,
        run_seed(),
        room // max(loading.workers, 1),
    )
    sampler: Sampler[Pick] = (
        TrainingOrder(dataset, dataset.seed, processes, process, draws)
        if part == "train"
        else MeasuringOrder(dataset, loading.batch_size, processes, process)
    )
    return LateLoader(
        dataset,
        batch_size=loading.batch_size,
        sampler=sampler,
        num_workers=loading.workers,
        persistent_workers=loading.workers > 0,
        collate_fn=packed,
    )


class LateLoader(DataLoader[Sample | InputError]):
    """Starts to read at the first batch, and raises the errors of workers.

    When a run resumes from a checkpoint, Lightning makes the iterators before it sets the epoch,
    and workers read ahead as soon as there is an iterator.
    """

    def __iter__(self) -> Any:
        for batch in super().__iter__():
            if isinstance(batch, InputError):
                raise batch
            yield batch


def packed(samples: Sequence[Sample | InputError]) -> Batch | InputError:
    """A batch of samples, or the first error among them."""
    for error in samples:
        if isinstance(error, InputError):
            return error
    stopwatch = Stopwatch()
    with stopwatch.stage(VIEW):
        batch = Batch.of([sample for sample in samples if isinstance(sample, Sample)])
    return replace(batch, milliseconds=summed_times([batch.milliseconds, stopwatch.milliseconds]))
