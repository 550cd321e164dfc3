"""Light through rain against the law of Beer and Lambert and numerical integrals."""

import numpy as np
import pytest
from numpy.typing import NDArray

from derain.simulation.marshall_palmer import extinction
from derain.simulation.rain_field import RainField, SprinkledRain, UniformRain
from derain.simulation.transmission import Transmission


def random_beams(count: int, generator: np.random.Generator) -> NDArray[np.float64]:
    beams = generator.normal(size=(count, 3))
    return beams / np.linalg.norm(beams, axis=1, keepdims=True)


def integrated(rain: RainField, beam: NDArray[np.float64], distance: float) -> float:
    way = np.linspace(0, distance, 2001)
    depth = np.trapezoid(extinction(rain.rate(way * beam[0], way * beam[1])), way)
    return float(np.exp(-2 * depth))


def test_even_rain_takes_light_exponentially_in_every_direction() -> None:
    generator = np.random.default_rng(0)
    beams = np.concatenate([random_beams(1000, generator), [[0, 0, 1], [0, 0, -1], [-1, 0, 0]]])
    distance = generator.uniform(0, 300, len(beams))  # also farther than the field is sampled
    share = Transmission(UniformRain(50), 120)(beams, distance)
    assert np.allclose(share, np.exp(-2 * extinction(50) * distance), rtol=1e-12)


def test_clear_air_takes_nothing() -> None:
    beams = random_beams(100, np.random.default_rng(1))
    assert (Transmission(UniformRain(0), 120)(beams, np.full(100, 80.0)) == 1).all()


@pytest.mark.parametrize("nominal", [10.0, 25.0, 50.0])
def test_uneven_rain_takes_light_by_the_integral_along_each_beam(nominal: float) -> None:
    rain, generator = SprinkledRain(nominal), np.random.default_rng(2)
    beams = random_beams(300, generator)
    beams[::2, :2] = [1, 0]  # half of them down the track, at all inclinations
    beams /= np.linalg.norm(beams, axis=1, keepdims=True)
    distance = generator.uniform(0.5, 110, len(beams))
    share = Transmission(rain, 120)(beams, distance)
    expected = [
        integrated(rain, beam, float(end)) for beam, end in zip(beams, distance, strict=True)
    ]
    assert np.abs(share - expected).max() < 0.01
    assert np.ptp(expected) > 0.1
