"""SalsaNext as it is trained: its Spec, its losses, its learning rate, published weights."""

import lightning
import numpy as np
import pytest
import torch
from torch import Tensor

from derain.cards.card import load_card
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.learning.batch import Batch
from derain.learning.losses import segmentation_loss
from derain.models.salsanext import SalsaNext
from derain.models.salsanext.network import SalsaNextNetwork
from derain.views.probability import probability_of_rain
from derain.views.spherical_grid import grid_of
from derain.views.view import IGNORED

from .test_network import published

WADS = load_card("wads")
MOMENTS = [(26.6, 19.7), *(WADS.statistics(name) for name in ("x", "y", "z", "intensity"))]


def test_the_spec_holds_how_the_network_is_used() -> None:
    spec = SalsaNext(grid="wads", threshold=0.25).spec_for(WADS)
    assert (spec.network, spec.threshold) == ("salsanext", 0.25)
    assert spec.channels == ("range", "x", "y", "z", "intensity")
    assert spec.units == ("m", "m", "m", "m", "0..255")
    assert [*zip(spec.mean, spec.std, strict=True)] == MOMENTS
    assert spec.view["grid"] == grid_of("wads", "").as_dict()
    assert spec.rule == {}
    assert (spec.data, spec.licence) == ("WADS", WADS.licence)
    assert (spec.classes, spec.rain) == (WADS.classes, (110,))


@torch.no_grad()
def test_published_weights_give_the_logits_of_the_network_on_normalised_images(
    image_network, sample
) -> None:
    network = image_network(SalsaNext).network
    model = SalsaNext.from_published(published(network), WADS, "semantickitti").eval()
    assert (model.spec.data, model.hparams["width"]) == ("WADS", 4)
    assert model.spec.view["grid"] == grid_of("semantickitti", "").as_dict()
    inputs = Batch.of([sample(image_network(SalsaNext), scene())]).inputs
    image = np.empty((1, 5, 18, 60), np.float32)
    for channel, (mean, std) in enumerate(MOMENTS):
        image[0, channel] = (inputs["image"][0, channel].numpy() - mean) / std
    image *= inputs["valid"].numpy()
    expected = network(torch.from_numpy(image)).permute(0, 2, 3, 1).reshape(-1, 2)
    torch.testing.assert_close(model(**inputs), expected, rtol=1e-4, atol=1e-4)


def test_weights_need_a_grid_and_a_card_with_statistics_of_range(image_network) -> None:
    weights = published(image_network(SalsaNext).network)
    with pytest.raises(InputError, match=r"the grid .*Give --grid\."):
        SalsaNext.from_published(weights, WADS)
    with pytest.raises(InputError, match="SemanticSpray: the data card has no statistics of range"):
        SalsaNext.from_published(weights, load_card("spray"), "semantickitti")


@pytest.mark.parametrize(
    ("size", "reason"),
    [
        ({"classes": 20}, "20 classes and 5 channels"),
        ({"channels": 4}, "2 classes and 4 channels"),
    ],
)
def test_weights_of_other_classes_or_channels_are_refused(size, reason) -> None:
    weights = published(SalsaNextNetwork(width=4, **size))
    with pytest.raises(InputError, match=reason):
        SalsaNext.from_published(weights, WADS, "wads")


@pytest.fixture
def pixels() -> tuple[Tensor, Tensor]:
    """Logits and targets of 500 pixels, a third of them empty and a sixth rain."""
    generator = torch.Generator().manual_seed(0)
    logits = torch.randn(500, 2, generator=generator)
    return logits, torch.tensor([IGNORED, 0, 0, IGNORED, 0, 1]).repeat(84)[:500]


def losing(published_loss: bool, weight: tuple[float, float] = (1.5, 6.0)) -> SalsaNext:
    model = SalsaNext(width=4, published_loss=published_loss)
    model.class_weight.copy_(torch.tensor(weight))
    return model


def test_the_published_loss_trains_empty_pixels_and_knows_no_false_alarm(pixels) -> None:
    logits, target = pixels
    loss = losing(published_loss=True).segmentation_loss(logits, target)
    found, rain = probability_of_rain(logits.numpy()).astype(np.float64), target.numpy() == 1
    probability = np.stack([1 - found, found], axis=1)
    assert loss.lovasz.item() == pytest.approx((1 - probability[rain, 1]).mean(), rel=1e-5)
    weight = np.where(rain, 6.0, 1.5)
    surprise = -np.log(probability[np.arange(500), rain.astype(int)])
    expected = (weight * surprise).sum() / weight.sum()
    assert loss.cross_entropy.item() == pytest.approx(expected, rel=1e-5)
    assert loss.loss.item() == pytest.approx((loss.cross_entropy + loss.lovasz).item())


def test_the_corrected_loss_leaves_empty_pixels_out(pixels) -> None:
    logits, target = pixels
    model, empty = losing(published_loss=False), target == IGNORED
    loss = model.segmentation_loss(logits, target)
    expected = segmentation_loss(logits[~empty], target[~empty], model.class_weight)
    assert [part.item() for part in loss] == [part.item() for part in expected]
    changed = torch.where(empty[:, None], 100 * logits + 7, logits)
    again = model.segmentation_loss(changed, target)
    assert [part.item() for part in again] == [part.item() for part in loss]
    as_published = losing(published_loss=True)
    assert not torch.equal(
        as_published.segmentation_loss(changed, target).loss,
        as_published.segmentation_loss(logits, target).loss,
    )


def test_false_alarms_cost_in_the_corrected_lovasz_loss_alone(pixels) -> None:
    _, target = pixels
    everything_rain = torch.tensor([[-50.0, 50.0]]).repeat(len(target), 1)
    share = (target == 1).sum() / (target != IGNORED).sum()
    corrected = losing(published_loss=False).segmentation_loss(everything_rain, target)
    # 1 - IoU is 1 for the pixels that are no rain, and what is not rain's share for rain.
    assert corrected.lovasz.item() == pytest.approx((1 + (1 - share.item())) / 2)
    as_published = losing(published_loss=True).segmentation_loss(everything_rain, target)
    assert as_published.lovasz.item() == 0


@pytest.mark.parametrize("published_loss", [False, True])
@pytest.mark.parametrize("of", [IGNORED, 0, 1], ids=["empty", "no rain", "nothing but rain"])
def test_both_losses_are_defined_for_one_kind_of_pixel(of, published_loss) -> None:
    logits = torch.randn(40, 2, generator=torch.Generator().manual_seed(0), requires_grad=True)
    loss = losing(published_loss).segmentation_loss(logits, torch.full((40,), of)).loss
    loss.backward()
    assert loss.isfinite()
    assert logits.grad.isfinite().all()


class LearningRates(lightning.Callback):
    """Keeps the learning rate of every step of the optimiser."""

    def __init__(self) -> None:
        self.values: list[float] = []

    def on_before_optimizer_step(
        self, trainer: lightning.Trainer, model: SalsaNext, optimizer: torch.optim.Optimizer
    ) -> None:
        self.values.append(optimizer.param_groups[0]["lr"])


@pytest.mark.parametrize("warm_up", [1, 2])
@pytest.mark.parametrize(("batches_a_step", "steps"), [(1, 3), (2, 2), (3, 1)])
def test_the_optimiser_and_its_learning_rate_at_every_step_are_as_published(
    make_trainer, scenes, small_grid, warm_up, batches_a_step, steps
) -> None:
    rates, decay = LearningRates(), 0.5
    accumulating = {"accumulate_grad_batches": batches_a_step, "limit_val_batches": 0}
    trainer = make_trainer(epochs=4, callbacks=[rates], **accumulating)
    model = SalsaNext(small_grid, width=2, warm_up=warm_up, decay=decay)
    trainer.fit(model, scenes("wads"))
    (optimizer,) = trainer.optimizers
    (group,) = optimizer.param_groups
    assert isinstance(optimizer, torch.optim.SGD)
    assert (group["momentum"], group["weight_decay"], group["nesterov"]) == (0.9, 1e-4, False)
    assert len(group["params"]) == len(list(model.parameters()))
    # Source: TiagoCortinhal/SalsaNext, warmupLR.py: a CyclicLR, then an exponential decay.
    rising = [0.01 * (step + 1) / (warm_up * steps) for step in range(warm_up * steps)]
    falling = [0.01 * decay ** (step / steps) for step in range((4 - warm_up) * steps)]
    assert rates.values == pytest.approx([*rising, *falling])
