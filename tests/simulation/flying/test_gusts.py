"""Fields of density."""

import numpy as np
import pytest

from derain.simulation.flying.gusts import Gusts
from derain.simulation.flying.precipitation import GustForm

FORMS: tuple[GustForm, ...] = ("gusts", "sheets", "filaments")
PLACES = np.random.default_rng(2).uniform(-60, 60, (20_000, 3))


def test_an_even_density_is_one() -> None:
    assert (Gusts("even", 1, 1, 0)(PLACES) == 1).all()


@pytest.mark.parametrize("form", FORMS)
def test_an_uneven_density_varies_smoothly_between_nothing_and_the_greatest(form: GustForm) -> None:
    density = Gusts(form, 2.0, 2.0, 7)
    here, beside = density(PLACES), density(PLACES + np.array([0.01, 0, 0]))
    assert (here >= 0).all()
    assert (here <= 1).all()
    assert here.std() > 0.1
    assert np.abs(beside - here).max() < 0.5
    assert (here == Gusts(form, 2.0, 2.0, 7)(PLACES)).all()
    assert (here != Gusts(form, 2.0, 2.0, 8)(PLACES)).any()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("contrast", [0.5, 2.0])
def test_the_mean_over_many_fields_is_that_of_gaussian_ones(
    form: GustForm, contrast: float
) -> None:
    means = [Gusts(form, 2.0, contrast, seed)(PLACES[:2000]).mean() for seed in range(40)]
    assert np.mean(means) == pytest.approx(Gusts(form, 2.0, contrast, 0).mean, rel=0.1)


def test_wisps_fill_less_than_sheets_and_sheets_less_than_gusts() -> None:
    thick = [(Gusts(form, 2.0, 2.0, 3)(PLACES) > 0.5).mean() for form in FORMS]
    assert thick[0] > thick[1] > thick[2] > 0


@pytest.mark.parametrize("length", [0.5, 8.0])
def test_the_density_is_alike_within_the_length_and_not_far_beyond(length: float) -> None:
    density = Gusts("gusts", length, 1.0, 5)
    here = density(PLACES)
    near = np.corrcoef(here, density(PLACES + np.array([length / 20, 0, 0])))[0, 1]
    far = np.corrcoef(here, density(PLACES + np.array([40 * length, 0, 0])))[0, 1]
    assert near > 0.95
    assert far < 0.5
