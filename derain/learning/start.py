"""A trained model that another one begins from, in place of weights drawn at random."""

from dataclasses import dataclass, replace
from pathlib import Path

from derain.default import DEFAULT, default_checkpoint
from derain.sources.training_record import record_of_parts
from derain.spec import Spec

# What a Spec's record of training has the models under that it began from, the first one first.
STARTED_FROM = "started from"

START_HELP = f"begin from the weights of a trained model: a checkpoint, or {DEFAULT}"


@dataclass(frozen=True)
class Start:
    """The trained model.

    Attributes:
        name: The user's name for it, and the beginning of its file's checksum.
        spec: Its Spec.
    """

    name: str
    spec: Spec

    def inherited_spec(self, spec: Spec) -> Spec:
        """The Spec of a model that begins from it, on data of its own.

        View, units, normalisation and rule are the start's, to which its weights belong. The record
        names the scans that both were trained on, for what is learnt from the one is in the other.

        Args:
            spec: The model's Spec without a start.
        """
        records = [(self.spec.data, self.spec.training), (spec.data, spec.training)]
        together = record_of_parts(
            (data, {kind: names for kind, names in record.items() if kind != STARTED_FROM})
            for data, record in records
        )
        starts = (*self.spec.training.get(STARTED_FROM, ()), self.name)
        return replace(
            spec,
            licence=f"{spec.licence}; started from {self.spec.data} ({self.spec.licence})",
            training={**together, STARTED_FROM: starts},
            view=self.spec.view,
            units=self.spec.units,
            mean=self.spec.mean,
            std=self.spec.std,
            rule=self.spec.rule,
        )


def checkpoint_of(start: str) -> Path:
    """The checkpoint of the model that a user names.

    Args:
        start: A checkpoint, or ``default``.
    """
    return default_checkpoint() if start == DEFAULT else Path(start)
