"""Networks on range images alike: their grid, empty pixels, and as they are exported."""

import pytest
import torch

from derain.cards.card import load_card
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.learning.batch import Batch
from derain.models.lisnownet import LiSnowNet
from derain.models.salsanext import SalsaNext
from derain.models.salsanext_lite import SalsaNextLite
from derain.scan import Scan
from derain.views.grid_fit import fit_grid
from derain.views.range_image import RangeView
from derain.views.spherical_grid import grid_of

all_models = pytest.mark.parametrize("model_class", [SalsaNext, SalsaNextLite, LiSnowNet])
both_views = pytest.mark.parametrize("model_class", [SalsaNext, LiSnowNet])


@both_views
def test_a_grid_is_fitted_to_the_training_scans(model_class) -> None:
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


@both_views
def test_a_grid_is_not_fitted_to_nothing(model_class) -> None:
    with pytest.raises(InputError, match=r"no scans to fit it to\. Give a grid by its name\."):
        model_class(width=2).spec_for(load_card("wads"))


@both_views
@pytest.mark.parametrize(
    "grid",
    ["semantickitti", "rehearse3d", "wads", {"rows": 8, "columns": 30, "inclination": [-9, 5]}],
    ids=str,
)
def test_a_stated_grid_is_taken_whatever_the_scans(model_class, grid) -> None:
    model = model_class(grid=grid, width=2, back_projection="vote")
    for scans in ([], [Scan.of(scene(100))]):
        expected = {"kind": "range", "grid": grid_of(grid, "").as_dict(), "way_back": "vote"}
        assert model.view_for(scans).as_dict() == expected


@both_views
def test_a_grid_that_there_is_not_is_refused(model_class) -> None:
    with pytest.raises(InputError, match="there is no grid named 'mars'"):
        model_class(grid="mars", width=2).spec_for(load_card("wads")).make_view()


@all_models
@pytest.mark.parametrize("content", [0.0, -1.0, 1e6, torch.nan])
@torch.no_grad()
def test_what_empty_pixels_hold_does_not_matter(
    image_network, sample, model_class, content
) -> None:
    model = image_network(model_class)
    inputs = Batch.of([sample(model, scene())]).inputs
    image, valid = inputs["image"], inputs["valid"]
    assert 0.1 < valid.float().mean() < 0.9
    changed = model(torch.where(valid, image, content), valid)
    kept = valid.flatten()
    torch.testing.assert_close(changed[kept], model(image, valid)[kept], rtol=0, atol=0)


@all_models
@torch.no_grad()
def test_the_deployed_network_computes_the_same(image_network, sample, model_class) -> None:
    model = image_network(model_class)
    inputs = Batch.of([sample(model, scene())]).inputs
    # Where a BatchNorm is folded into its convolution, sums are rounded elsewhere.
    rounding = 1e-4 if model_class is SalsaNextLite else 0
    deployed, trained = model.deployed()(**inputs), model(**inputs)
    torch.testing.assert_close(deployed, trained, rtol=rounding, atol=rounding)
