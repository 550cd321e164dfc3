"""Cues: evidence of rain from geometry and from brightness, weighed by one fusion."""

import math
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

import torch
from lightning.pytorch.utilities.types import OptimizerLRScheduler
from torch import Tensor
from torch.nn import functional

from derain.errors import InputError
from derain.learning.batch import Batch
from derain.models.cues.network import APART, CueNetwork, both_logits
from derain.models.registry import NETWORKS
from derain.models.supervised import SupervisedModule
from derain.scan import Scan
from derain.views.isolated_points import CHANNELS, IsolatedPointView
from derain.views.view import IGNORED, View

# How much the answers of geometry and of each round count in the loss.
WEIGHTS = (0.3, 0.3, 1.0)

# Share of the training in which the learning rate rises; then it falls.
WARM_UP_SHARE = 0.1

# The learning rate rises in this many steps at least: torch would divide a single one by 0.
SHORTEST_WARM_UP = 1.5

# The first learning rate is the highest divided by this, and the last at least this share of it.
FIRST_DIVISOR, LEAST_SHARE = 25.0, 4e-6


@NETWORKS.add("cues")
class CueFusion(SupervisedModule):
    """Trains the network of cues.

    Geometry judges without intensity. What its answers show of rain's intensities in that very
    scan is the second cue, so that no unit, gain or sensor has to be known.

    Example:
        >>> trainer = Trainer(max_epochs=2, logger=False, enable_progress_bar=False)
        >>> data = derain.Folder(".", "wads", train=["scan.bin"], validation=["scan.bin"])
        >>> model = CueFusion()
        >>> trainer.fit(model, data)
        >>> model.spec.view
        {'kind': 'isolated_points', 'neighbours': 9}

    Args:
        neighbours: k, the size of a neighbourhood, the point itself included; at least 9.
        width: Features of a point.
        of_neighbour: Features of each neighbour, of where it is.
        opinion: Number of features that a point passes to those that it is a neighbour of.
        context: Features of what a scan holds at some range.
        fusion: Features of a point in the layers that weigh the cues.
        without_intensity: Added to the log-odds of scans without intensities; chosen after the
            training.
        learning_rate: Of AdamW, where it is highest.
        weight_decay: Of AdamW.
        final_share: Share of the learning rate at the end; above 0 where weights are
            averaged over the last part of the training.
        threshold: A point is rain where its probability is greater.
        balance: Extra weight of the rarer class: 0 not at all, so that a point wrongly
            called rain counts for no less than one that is missed; 1 by the inverse of its share.
        spec: Set by derain when it saves a checkpoint; leave it out otherwise.

    Raises:
        InputError: Fewer than 9 neighbours.
    """

    VIEW: ClassVar[type[View]] = IsolatedPointView
    RECIPE: ClassVar[tuple[str, ...]] = (*SupervisedModule.RECIPE, "final_share")
    network: CueNetwork

    def __init__(
        self,
        neighbours: int = 9,
        width: int = 32,
        of_neighbour: int = 8,
        opinion: int = 12,
        context: int = 16,
        fusion: int = 64,
        without_intensity: float = 0.0,
        learning_rate: float = 5e-3,
        weight_decay: float = 1e-4,
        final_share: float = 0.0,
        threshold: float = 0.5,
        balance: float = 0.0,
        spec: dict[str, Any] | None = None,
    ) -> None:
        super().__init__(CHANNELS)
        if neighbours <= APART[-1]:
            reason, remedy = f"{neighbours} are too few", f"Give {APART[-1] + 1} or more."
            raise InputError("neighbours", reason, remedy)
        self.save_hyperparameters()
        self.network = CueNetwork(
            neighbours, width, of_neighbour, opinion, context, fusion, without_intensity
        )
        self.adopt(spec)

    def view_for(self, scans: Sequence[Scan]) -> IsolatedPointView:
        """The view that the network sees a scan through, whatever the scans."""
        return IsolatedPointView(self.hparams["neighbours"])

    def accepts_view(self, view: View) -> bool:
        """True if the network can take what a Spec's view gives: as many neighbours."""
        return isinstance(view, IsolatedPointView) and view.neighbours == self.hparams["neighbours"]

    def forward(self, **inputs: Tensor) -> Tensor:
        """Logits, float (S, 2), of one scan; inputs as for :class:`CueNetwork`."""
        return self.network(**inputs)

    def logits_of(self, batch: Batch) -> Tensor:
        """Logits of every isolated point, float (S, 2), scan by scan: each has its own context."""
        return both_logits(self._answers(batch)[-1])

    def losses(self, batch: Batch) -> tuple[dict[str, Tensor], Tensor]:
        """Loss of geometry and of each round of the fusion, and the logits as they are judged."""
        assert batch.target is not None  # the data modules pair these scans with labels
        answers, judged = self._answers(batch), batch.target != IGNORED
        target = batch.target[judged].to(answers[0].dtype)
        weight = self.class_weight[batch.target[judged]]
        each = [
            functional.binary_cross_entropy_with_logits(
                answer[judged], target, weight, reduction="sum"
            )
            / max(len(target), 1)  # a batch may hold no isolated point with a label
            for answer in answers[:-1]  # the last, as judged, is not learnt
        ]
        loss = torch.stack([share * one for share, one in zip(WEIGHTS, each, strict=True)]).sum()
        losses = {"loss": loss, "geometry": each[0], "fusion": each[-1]}
        return losses, both_logits(answers[-1])

    def deployed(self) -> CueNetwork:
        """The network as it is exported."""
        return self.network

    def configure_optimizers(self) -> OptimizerLRScheduler:
        """AdamW with a learning rate that rises and falls once in the whole training.

        Source: L. N. Smith and N. Topin, "Super-Convergence: Very Fast Training of Neural Networks
            Using Large Learning Rates", 2018.

        Raises:
            InputError: A training without a last step.
        """
        steps = self.trainer.estimated_stepping_batches
        if steps == math.inf:
            raise InputError(
                "--trainer.max_epochs",
                "without it, the learning rate cannot be planned to the last step",
                "Give it, or --trainer.max_steps.",
            )
        rate = self.hparams["learning_rate"]
        optimizer = torch.optim.AdamW(
            self.parameters(), lr=rate, weight_decay=self.hparams["weight_decay"]
        )
        steps = max(int(steps), 2)
        schedule = torch.optim.lr_scheduler.OneCycleLR(
            optimizer,
            rate,
            total_steps=steps,
            pct_start=max(WARM_UP_SHARE, SHORTEST_WARM_UP / steps),
            div_factor=FIRST_DIVISOR,
            final_div_factor=1 / (FIRST_DIVISOR * max(self.hparams["final_share"], LEAST_SHARE)),
        )
        return {
            "optimizer": optimizer,
            "lr_scheduler": {"scheduler": schedule, "interval": "step"},
        }

    def _answers(self, batch: Batch) -> list[Tensor]:
        """All answers of :meth:`CueNetwork.answers`, float (S,) each, of all scans."""
        of_scans = [self.network.answers(**scan) for scan in _scans_of(batch)]
        return [torch.cat(answers) for answers in zip(*of_scans, strict=True)]


def _scans_of(batch: Batch) -> Iterator[dict[str, Tensor]]:
    """Splits a batch into the network's inputs for each scan; all of them share the points."""
    shared = {name: batch.inputs[name] for name in ("points", "cell")}
    split = {name: batch.split(batch.inputs[name]) for name in ("distances", "neighbours")}
    for scan in range(len(batch.cells)):
        own = {name: batch.inputs[name][scan] for name in ("step", "counts")}
        yield shared | own | {name: parts[scan] for name, parts in split.items()}
