"""The base class of derainers: their Spec, and the step of training."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import torch
from lightning import Callback
from lightning.pytorch.trainer.states import TrainerFn
from lightning.pytorch.utilities.types import OptimizerLRScheduler
from torch import Tensor, nn

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.evaluation.metrics import RainMetrics
from derain.evaluation.operating_points import ThresholdCounts
from derain.files.documents import Entry, shown
from derain.learning.batch import Batch
from derain.learning.seeds import Draw, generator_of, run_seed
from derain.learning.start import Start
from derain.learning.task import Task, TrainingData, agree_on_task
from derain.models.callbacks.finite_loss import FiniteLoss
from derain.models.callbacks.resumption import Resumption
from derain.models.measured import MeasuredModule, log_hyperparameters
from derain.scan import Scan
from derain.spec import Spec
from derain.views.candidates import Candidates
from derain.views.view import View


class DerainingModule(MeasuredModule):
    """A network with its loss and Spec.

    A network enters derain by its file in ``derain/models``, or by an entry point
    ``derain.networks`` of another package, and the decorator that gives it its name::

        @NETWORKS.add("outdet")
        class OutDet(SupervisedModule): ...

    The Spec comes from the first data the model is trained on and from then on travels in its
    checkpoints; so the input's normalisation is never configured twice.

    Attributes:
        NAME: Name of the network in a Spec and on the command line; the decorator sets it.
        VIEW: Kind of the view that it sees a scan through.
        LOGIT_GAIN: Amplification of rounding in its logits, relative to other networks.
        RECIPE: Names of the arguments of its training and of what is called rain. One that
            starts from another model keeps its own, and has the other's in place of all the rest.
        INTEGER_OPERATORS: Operators in eight bits of a model that is exported so; ONNX names.
        channels: Names of its input channels, as :meth:`Scan.channel` takes them.
        network: The network itself.
        card: Data card of the data it is trained or tested on, once that is agreed with them.
        start: The trained model that its weights are of before it is trained; None where they are
            drawn at random.

    Raises:
        InputError: A network without a name; no channels, or one twice.
    """

    NAME: ClassVar[str]
    VIEW: ClassVar[type[View]]
    LOGIT_GAIN: ClassVar[float] = 1.0
    RECIPE: ClassVar[tuple[str, ...]] = (
        "learning_rate",
        "weight_decay",
        "decay",
        "threshold",
        "candidates",
        "balance",
    )
    INTEGER_OPERATORS: ClassVar[tuple[str, ...]] = ("Conv",)
    network: nn.Module
    mean: Tensor
    std: Tensor

    def __init__(self, channels: Sequence[str]) -> None:
        super().__init__()
        if not hasattr(self, "NAME"):
            raise InputError(
                type(self).__name__,
                "the network has no name",
                'Put @NETWORKS.add("its name") before the class.',
            )
        if not channels or len(set(channels)) < len(channels):
            raise InputError(
                "channels", f"{list(channels)} is no choice", "Name each channel once."
            )
        self.channels = tuple(channels)
        self._spec: Spec | None = None
        self.start: Start | None = None
        # Not in the state_dict: the Spec holds them.
        self.register_buffer("mean", torch.zeros(len(channels)), persistent=False)
        self.register_buffer("std", torch.ones(len(channels)), persistent=False)

    @property
    def has_spec(self) -> bool:
        """True if it has a Spec, from a training or a checkpoint."""
        return self._spec is not None

    @property
    def spec(self) -> Spec:
        """The Spec: how the network is used.

        Raises:
            InputError: It has none yet, from data or from a checkpoint.
        """
        if self._spec is None:
            raise InputError(self.NAME, "has not been trained", "Give a checkpoint: --ckpt_path.")
        return self._spec

    @abstractmethod
    def view_for(self, scans: Sequence[Scan]) -> View:
        """The view that the network sees a scan through.

        Args:
            scans: Training scans that it may be fitted to; none for published weights.

        Raises:
            InputError: A view that needs scans to be fitted to, and none given.
        """

    def accepts_view(self, view: View) -> bool:
        """True if the network can take what a Spec's view gives: by default, any of its kind."""
        return isinstance(view, self.VIEW)

    def rule_for(self, scans: Sequence[Scan]) -> Mapping[str, float]:
        """Constants of the network's own rule for rain, fitted to training scans.

        By default there are none. A network that has some reads them back in :meth:`adopt_rule`.
        """
        return {}

    def candidates_for(self, card: DataCard, scans: Sequence[Scan]) -> Candidates | None:
        """Bounds outside which nothing is rain, fitted to training scans; by default none.

        Args:
            card: Data card of the scans.
            scans: Training scans, with the labels that the network learns from; none for published
                weights.
        """
        return None

    def adopt_rule(self, rule: Entry) -> None:
        """Takes over the constants of the network's own rule from its Spec.

        Args:
            rule: The entry ``rule`` of the Spec. It is not trusted.

        Raises:
            InputError: Unknown constants, or some of its own missing.
        """
        if rule.members():
            raise rule.fault(
                f"{self.NAME} has no rule with constants {shown(rule.value)}",
                f"Give a model of {self.NAME}.",
            )

    @abstractmethod
    def configure_optimizers(self) -> OptimizerLRScheduler:
        """The optimiser and its schedule, for Lightning."""

    def deployed(self) -> nn.Module:
        """The network for export, in evaluation mode: from raw inputs to logits.

        By default the module itself. What can be computed once, such as a BatchNorm that follows a
        convolution, a network may fold away here.
        """
        return self

    def adopt(self, spec: Spec | dict[str, Any] | None) -> None:
        """Takes over a Spec, its normalisation included.

        Raises:
            InputError: A Spec that this derain cannot read, or of another network or channels.
        """
        if spec is None:
            return
        spec = spec if isinstance(spec, Spec) else Spec.from_dict(spec, "checkpoint")
        if (spec.network, spec.channels) != (self.NAME, self.channels):
            raise InputError(
                "checkpoint",
                f"a model of {spec.network} on {', '.join(spec.channels)}",
                f"Give one of {self.NAME} on {', '.join(self.channels)}.",
            )
        if not self.accepts_view(spec.make_view()):
            raise InputError(
                "checkpoint", f"its view is {shown(spec.view)}", f"Give a model of {self.NAME}."
            )
        self.adopt_rule(Entry("checkpoint", "rule", dict(spec.rule)))
        self._spec = spec
        self.hparams["spec"] = spec.as_dict()
        self.mean.copy_(torch.tensor(spec.mean))
        self.std.copy_(torch.tensor(spec.std))

    def spec_for(self, card: DataCard, scans: Sequence[Scan] = ()) -> Spec:
        """Spec of this network on a data set.

        Args:
            card: Its data card.
            scans: Training scans that view, rule and candidates are fitted to, if they are not
                stated.

        Raises:
            InputError: A data card without statistics, or no scans where they are needed.
        """
        statistics = [card.statistics(channel) for channel in self.channels]
        return Spec(
            network=self.NAME,
            view=self.view_for(scans).as_dict(),
            channels=self.channels,
            units=tuple(card.unit(channel) for channel in self.channels),
            mean=tuple(mean for mean, _ in statistics),
            std=tuple(std for _, std in statistics),
            rule=self.rule_for(scans),
            classes=card.classes,
            rain=card.rain,
            threshold=self.hparams["threshold"],
            candidates=self.candidates_for(card, scans),
            data=card.name,
            licence=card.licence,
        )

    def adopt_task(self, task: Task) -> None:
        """Takes over what was agreed with the data: how the network is used, what is counted.

        Raises:
            InputError: A Spec of another network.
        """
        if task.spec is not self._spec:
            self.adopt(task.spec)
        self.card = task.card
        self.metrics = RainMetrics(self.card).to(self.device)
        self.threshold_counts = ThresholdCounts([task.spec.threshold]).to(self.device)

    def setup(self, stage: str) -> None:
        """Agrees with the data, unless the Spec is still to come: from a checkpoint.

        Raises:
            InputError: Neither a data module, nor a task that was agreed before.
        """
        self.warned_of_no_rain = False  # in this run
        data = self.trainer.datamodule  # type: ignore[attr-defined]
        if not isinstance(data, TrainingData):
            if not hasattr(self, "card"):
                raise InputError(
                    self.NAME,
                    "has no data module, and no task agreed with one",
                    "Call derain.learning.task.agree_on_task(model, data) before.",
                )
        elif stage == "fit" or self.has_spec:
            agree_on_task(self, data, training=stage == "fit")

    def configure_callbacks(self) -> list[Callback]:
        """Callbacks that guard a training of any network, with any trainer."""
        return [FiniteLoss(), Resumption()]

    def on_load_checkpoint(self, checkpoint: dict[str, Any]) -> None:
        """Takes the Spec from the checkpoint that a run starts from.

        Raises:
            InputError: A checkpoint of something else.
        """
        spec = checkpoint.get("hyper_parameters", {}).get("spec")
        if spec is None:
            raise InputError("checkpoint", "it has no Spec", "Give a checkpoint of derain.")
        agreed = self._spec
        self.trained_steps = checkpoint.get("global_step")
        self.adopt(spec)
        if self._trainer is not None and self._trainer.state.fn != TrainerFn.FITTING:
            checkpoint.pop("loops", None)  # no measurement goes on with an earlier one
        data = getattr(self._trainer, "datamodule", None)
        if isinstance(data, TrainingData):
            agree_on_task(self, data, training=False)  # again: the checkpoint has the last word
        elif agreed is not None and self._trainer is not None and not _alike(self.spec, agreed):
            raise InputError(
                "checkpoint",
                "its view differs from that of the loader",
                "Load the model from it before the loader is made.",
            )

    def on_train_start(self) -> None:
        """Enters the run in TensorBoard's table of hyper-parameters, to be ranked by its IoU."""
        log_hyperparameters(
            self.loggers, {"network": self.NAME, "data": self.card.name, **self.hparams}
        )

    def on_test_start(self) -> None:
        """Enters a tested model likewise: its training may have entered it elsewhere, or not."""
        self.on_train_start()

    def on_train_batch_start(self, batch: Batch, batch_idx: int) -> None:
        """Draws dropout by seed, epoch, step and process, so that a resume changes nothing."""
        step = (self.current_epoch, batch_idx, self.global_rank)
        torch.manual_seed(int(generator_of(Draw.NETWORK, run_seed(), *step).integers(2**63)))

    def training_step(self, batch: Batch) -> Tensor:
        """Loss of one batch."""
        losses, _ = self.losses(batch)
        values = {f"train/{name}": value for name, value in losses.items()}
        scans = len(batch.cells)
        self.log_dict(values, on_step=False, on_epoch=True, sync_dist=True, batch_size=scans)
        return losses["loss"]


def _alike(first: Spec, second: Spec) -> bool:
    """True if networks of two Specs see the same cells of a scan."""
    return (first.view, first.candidates) == (second.view, second.candidates)
