"""Where particles may be, along beams and in space."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from derain.simulation.classes import TrackClass, packed
from derain.simulation.flying.particles import Stretch
from derain.simulation.flying.precipitation import UNEVEN
from derain.simulation.flying.regions import GroundLayer, Gusts, Plume, draw_plumes
from derain.simulation.sensor import Returns, Sensor

EVEN = Gusts("even", 1, 1, 0)
BEAMS = Sensor(columns=90, rows=31, azimuth=(-180, 180), inclination=(-60, 60)).beams()
STRETCH = Stretch(np.full(len(BEAMS), 1.0), np.full(len(BEAMS), 40.0))
PLUME = Plume(np.array([6.0, 2.0, -1.7]), np.array([-1.0, 0.0, 0.0]), 5.0)
PLACES = np.random.default_rng(2).uniform(-60, 60, (10_000, 3))


@pytest.mark.parametrize(
    "region",
    [EVEN, GroundLayer(-1.7, 0.1, EVEN), GroundLayer(-1.7, 0.8, EVEN), PLUME],
    ids=["air", "low", "high", "plume"],
)
def test_a_beam_is_in_the_region_on_no_more_than_its_stretch(region) -> None:
    stretch = region.stretch(BEAMS, STRETCH)
    distance = np.linspace(1, 40, 400)
    place = BEAMS[:, None] * distance[:, None]
    density = region.density(place.reshape(-1, 3)).reshape(len(BEAMS), -1)
    assert (density >= 0).all()
    assert (density <= 1).all()
    inside = (stretch.near[:, None] <= distance) & (distance <= stretch.far[:, None])
    # What of a layer is above its top is almost nothing, and is left out.
    assert density[~inside].max(initial=0) < 0.02
    assert density[inside].max() > 0.3


@pytest.mark.parametrize("form", UNEVEN)
@pytest.mark.parametrize("contrast", [0.5, 2.0])
def test_the_mean_over_many_fields_is_that_of_gaussian_ones(form, contrast) -> None:
    fields = [Gusts(form, 2.0, contrast, seed).density(PLACES[:1000]) for seed in range(40)]
    assert np.min(fields) >= 0
    assert np.max(fields) <= 1
    assert np.mean(fields) == pytest.approx(Gusts(form, 2.0, contrast, 0).mean, rel=0.1)


@pytest.mark.parametrize("form", UNEVEN)
@pytest.mark.parametrize("length", [0.5, 8.0])
def test_the_density_is_alike_within_the_length_and_not_far_beyond(form, length) -> None:
    here, near, far = (
        Gusts(form, length, 1.0, 5).density(PLACES + np.array([shift * length, 0, 0]))
        for shift in (0, 0.05, 40)
    )
    assert np.corrcoef(here, near)[0, 1] > 0.9
    assert np.corrcoef(here, far)[0, 1] < 0.5


def test_drifting_snow_thins_out_with_height() -> None:
    layer = GroundLayer(-2.0, 0.2, EVEN)
    density = layer.density(np.array([[5.0, 0, -2.1], [5, 0, -2.0], [5, 0, -1.8], [5, 0, -1.6]]))
    assert density == pytest.approx([0, 1, np.exp(-1), np.exp(-2)])


def returns(places: np.ndarray, label: int) -> tuple[Returns, np.ndarray]:
    distance = np.linalg.norm(places, axis=1)
    count = len(places)
    clear = Returns(distance, np.full(count, 0.3), np.full(count, label), np.arange(count))
    return clear, places / distance[:, None]


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32), x=st.floats(-30, 30), y=st.sampled_from([-4.0, 3.0]))
def test_spray_is_behind_a_car_at_one_of_its_ends(seed, x, y) -> None:
    generator = np.random.default_rng(seed)
    car = np.array([x, y, -1.0]) + generator.uniform(-1, 1, (50, 3)) * [2.0, 0.8, 0.5]
    kind = np.full(1, int(TrackClass.CAR))
    clear, beams = returns(car, int(packed(kind, np.full(1, 9))[0]))
    plumes = draw_plumes(clear, beams, -1.7, 3, 4.0, generator)
    assert len(plumes) == 3
    for plume in plumes:
        front, rear = car[:, 0].max(), car[:, 0].min()
        assert plume.start[0] == pytest.approx(front if plume.heading[0] > 0 else rear)
        assert abs(plume.start[1] - y) < 0.8
        assert (plume.density(car)[np.abs(car[:, 0] - plume.start[0]) > 1e-9] == 0).all()


def test_no_car_raises_no_spray() -> None:
    clear, beams = returns(np.array([[5.0, 1, 0], [7, 1, 0]]), int(TrackClass.ROAD))
    assert draw_plumes(clear, beams, -1.7, 3, 4.0, np.random.default_rng(0)) == []
