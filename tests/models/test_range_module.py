"""Networks on range images alike: their grid, and that no scan breaks them."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch

from derain.cards.card import load_card
from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.learning.batch import Batch, Sample
from derain.models.base import DerainingModule
from derain.models.lisnownet import LiSnowNet
from derain.models.salsanext import SalsaNext
from derain.models.salsanext_lite import SalsaNextLite
from derain.scan import Scan
from derain.views.grid_fit import fit_grid
from derain.views.range_image import RangeView
from derain.views.spherical_grid import grid_of

HARD_CASES = dict(hard_cases(largest=5000))
MakeModel = Callable[..., DerainingModule]
MakeSample = Callable[..., Sample]

all_models = pytest.mark.parametrize("model_class", [SalsaNext, SalsaNextLite, LiSnowNet])


@all_models
def test_a_grid_is_fitted_to_the_training_scans(model_class: type[DerainingModule]) -> None:
    scans = [Scan.of(scene(500, seed)) for seed in range(3)]
    spec = model_class(width=2).spec_for(load_card("wads"), scans)
    expected = fit_grid(scans).grid
    assert spec.view == {
        "kind": "range",
        "grid": expected.as_dict(),
        "way_back": "nearest range",
    }
    view = spec.make_view()
    assert isinstance(view, RangeView)
    assert view.grid == expected


@all_models
def test_a_grid_is_not_fitted_to_nothing(model_class: type[DerainingModule]) -> None:
    with pytest.raises(InputError, match=r"no scans to fit it to\. Give a grid by its name\."):
        model_class(width=2).spec_for(load_card("wads"))


@all_models
@pytest.mark.parametrize(
    "grid",
    ["semantickitti", "rehearse3d", "wads", {"rows": 8, "columns": 30, "inclination": [-9, 5]}],
    ids=str,
)
def test_a_stated_grid_is_taken_whatever_the_scans(
    model_class: type[DerainingModule], grid: str | dict[str, Any]
) -> None:
    model = model_class(grid=grid, width=2, back_projection="vote")
    for scans in ([], [Scan.of(scene(100))]):
        expected = {"kind": "range", "grid": grid_of(grid, "").as_dict(), "way_back": "vote"}
        assert model.view_for(scans).as_dict() == expected


@all_models
@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ({"grid": "mars"}, "there is no grid named 'mars'. Known are semantickitti"),
        ({"grid": {"rows": 8}}, "grid: columns is missing"),
        ({"grid": "wads", "back_projection": "guess"}, "no such back-projection: 'guess'"),
    ],
)
def test_a_view_that_there_is_not_is_refused(
    model_class: type[DerainingModule], arguments: dict[str, Any], reason: str
) -> None:
    with pytest.raises(InputError) as refusal:
        model_class(**arguments, width=2).spec_for(load_card("wads")).make_view()
    assert reason in str(refusal.value)


@all_models
@pytest.mark.parametrize("content", [0.0, -1.0, 1e6, torch.nan])
@torch.no_grad()
def test_what_empty_pixels_hold_does_not_matter(
    image_network: MakeModel,
    image_sample: MakeSample,
    model_class: type[DerainingModule],
    content: float,
) -> None:
    model = image_network(model_class)
    inputs = Batch.of([image_sample(model, scene())]).inputs
    image, valid = inputs["image"], inputs["valid"]
    assert 0.1 < valid.float().mean() < 0.9
    changed = model(torch.where(valid, image, content), valid)
    kept = valid.flatten()
    torch.testing.assert_close(changed[kept], model(image, valid)[kept], rtol=0, atol=0)


@all_models
@torch.no_grad()
def test_packed_scans_get_the_logits_they_get_alone(
    image_network: MakeModel, image_sample: MakeSample, model_class: type[DerainingModule]
) -> None:
    model = image_network(model_class).double()
    samples = [image_sample(model, scene(points, points)) for points in (300, 0, 7, 3000)]

    def logits_of(*together: Sample) -> torch.Tensor:
        inputs = Batch.of(together).inputs
        return model(inputs["image"].double(), inputs["valid"])

    for logits, own in zip(Batch.of(samples).split(logits_of(*samples)), samples, strict=True):
        torch.testing.assert_close(logits, logits_of(own), atol=1e-8, rtol=1e-8)


@all_models
@torch.no_grad()
def test_the_deployed_network_computes_the_same(
    image_network: MakeModel, image_sample: MakeSample, model_class: type[DerainingModule]
) -> None:
    model = image_network(model_class)
    inputs = Batch.of([image_sample(model, scene())]).inputs
    # Where a BatchNorm is folded into its convolution, sums are rounded elsewhere.
    rounding = 1e-4 if model_class is SalsaNextLite else 0
    deployed, trained = model.deployed()(**inputs), model(**inputs)
    torch.testing.assert_close(deployed, trained, rtol=rounding, atol=rounding)


def step(model: DerainingModule, batch: Batch, bfloat16: bool = False) -> None:
    """Takes a training step and looks at everything in it."""
    model.train()
    optimizer = torch.optim.SGD(model.parameters(), lr=1e-3, momentum=0.9)
    with torch.autocast("cpu", dtype=torch.bfloat16, enabled=bfloat16):
        losses, logits = model.losses(batch)
    losses["loss"].backward()
    assert logits.shape == (sum(batch.cells), 2)
    assert logits.isfinite().all()
    assert all(loss.isfinite() for loss in losses.values())
    for parameter in model.parameters():
        assert parameter.grad is not None
        assert parameter.grad.isfinite().all()
    optimizer.step()
    assert all(tensor.isfinite().all() for tensor in model.state_dict().values())


@all_models
@pytest.mark.parametrize("scan", HARD_CASES.values(), ids=HARD_CASES)
def test_a_hard_scan_can_be_learnt_from_and_judged(
    image_network: MakeModel,
    image_sample: MakeSample,
    model_class: type[DerainingModule],
    scan: Scan,
) -> None:
    model = image_network(model_class)
    batch = Batch.of([image_sample(model, scan)])
    step(model, batch)
    model.eval()
    with torch.no_grad():
        losses, logits = model.losses(batch)
    assert all(loss.isfinite() for loss in losses.values())
    (probability,) = model.probabilities(batch, logits)
    assert probability.shape == (len(scan),)
    assert ((probability >= 0) & (probability <= 1)).all()
    assert (probability[~scan.valid] == 0).all()


@all_models
@pytest.mark.parametrize(
    "name", ["empty", "one point", "near and far together", "constant image", "intensity 65,535"]
)
def test_a_hard_scan_can_be_learnt_from_in_bfloat16(
    image_network: MakeModel,
    image_sample: MakeSample,
    model_class: type[DerainingModule],
    name: str,
) -> None:
    model = image_network(model_class)
    step(model, Batch.of([image_sample(model, HARD_CASES[name])]), bfloat16=True)


@all_models
def test_all_hard_scans_at_once_can_be_learnt_from(
    image_network: MakeModel, image_sample: MakeSample, model_class: type[DerainingModule]
) -> None:
    model = image_network(model_class)
    step(model, Batch.of([image_sample(model, scan) for scan in HARD_CASES.values()]))


@all_models
@pytest.mark.parametrize("rain", [0.0, 1.0], ids=["no rain", "nothing but rain"])
def test_scans_of_one_class_can_be_learnt_from(
    image_network: MakeModel,
    image_sample: MakeSample,
    model_class: type[DerainingModule],
    rain: float,
) -> None:
    model = image_network(model_class)
    step(model, Batch.of([image_sample(model, scene(), rain=rain)]))


@all_models
def test_a_few_steps_lower_the_loss(
    image_network: MakeModel, image_sample: MakeSample, model_class: type[DerainingModule]
) -> None:
    model = image_network(model_class, dropout=0.0).train()
    batch = Batch.of([image_sample(model, scene(3000, seed)) for seed in range(2)])
    optimizer = torch.optim.Adam(model.parameters(), 1e-2)
    values = []
    for _ in range(20):
        loss = model.losses(batch)[0]["loss"]
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        values.append(loss.item())
    assert np.mean(values[-3:]) < 0.8 * values[0]
