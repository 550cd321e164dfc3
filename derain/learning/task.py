"""The task that a model and its data agree on, once, before the first batch.

The data have a card and training scans. The model needs columns, labels, and a view fitted to some
of the scans. The :class:`Task` holds both; from then on neither depends on the other.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from derain.cards.card import DataCard
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.spec import Spec
from derain.views.channels import extra_channels

if TYPE_CHECKING:
    from derain.models.base import DerainingModule

# Scans that a view or a rule is fitted to; more change its grid by nothing.
EXAMPLE_SCANS = 20


@dataclass(frozen=True)
class Task:
    """The terms on which a model and its data work together.

    Attributes:
        card: Data card of the scans, with the statistics that training needs.
        spec: Use of the network: its view, channels and normalisation.
        reads_labels: True if training learns from labels; where not, none is read for it.
    """

    card: DataCard
    spec: Spec
    reads_labels: bool = True

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of a scan that the network sees besides those that every scan has."""
        return extra_channels(self.spec.channels)


@runtime_checkable
class TrainingData(Protocol):
    """The interface of a data module that the agreement needs."""

    card: DataCard
    task: Task | None

    def complete_card(self, columns: Sequence[str], labelled: bool) -> None:
        """Gives the data card the statistics that it lacks, of some columns too."""

    def training_scans(
        self, most: int, columns: Sequence[str] | None = None, labelled: bool = True
    ) -> Iterator[Scan]:
        """Some of the training scans."""

    def training_record(self) -> Mapping[str, tuple[str, ...]]:
        """The record of its training scans, for the Spec."""


@runtime_checkable
class ReadableScans(Protocol):
    """A data set of a loader whose scans can be read besides, as they are in their files."""

    frames: Sequence[Frame]

    def scans(self, most: int) -> Iterator[Scan]:
        """Some of them, spread over all."""


def agree_on_task(model: "DerainingModule", data: TrainingData, training: bool = True) -> Task:
    """Settles how a model and its data work together, and gives it to both.

    Lightning's trainer has it done by the model's ``setup`` wherever there is a data module. It is
    called by hand where loaders are made by :func:`derain.datamodules.loader.scan_loader`.

    Args:
        model: The model. One that has a Spec, of an earlier training or of a checkpoint, keeps it.
        data: Its data module.
        training: True if the model is to be trained: then what the data card lacks is measured,
            and a model without a Spec gets one, its view fitted to training scans.

    Raises:
        InputError: A model without a Spec that is not to be trained, or data that cannot be read or
            lack what the model needs.
    """
    columns, labelled = extra_channels(model.channels), model.LEARNS_FROM_LABELS
    if training:
        data.complete_card(columns, labelled)
    if training and not model.has_spec:
        scans = list(data.training_scans(EXAMPLE_SCANS, columns, labelled))
        spec = replace(model.spec_for(data.card, scans), training=data.training_record())
        if model.start is not None:
            spec = model.start.inherited_spec(spec)
    else:
        spec = model.spec
    task = Task(data.card, spec, labelled)
    model.adopt_task(task)
    data.task = task
    return task
