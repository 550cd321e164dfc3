"""Rough surfaces against the whole of Oren and Nayar's formula, and against Lambert's."""

import math

import numpy as np
import pytest

from derain.simulation.track import backscatter

ANGLES = np.radians(np.linspace(0, 89, 90))


def radiance(light: float, eye: float, turn: float, roughness: float) -> float:
    """Radiance over that of Lambert's surface lit straight on, from and to any direction."""
    variance = roughness**2
    facing, grazing = 1 - 0.5 * variance / (variance + 0.33), 0.45 * variance / (variance + 0.09)
    between = max(0, math.cos(turn)) * math.sin(max(light, eye)) * math.tan(min(light, eye))
    return math.cos(light) * (facing + grazing * between)


@pytest.mark.parametrize("roughness", [0.0, 0.1, 0.3, 0.6, 1.0])
def test_light_comes_back_as_if_the_eye_were_where_the_light_is(roughness: float) -> None:
    returned = backscatter(np.cos(ANGLES), np.full(len(ANGLES), roughness))
    expected = [radiance(angle, angle, 0, roughness) for angle in ANGLES]
    np.testing.assert_allclose(returned, expected, rtol=1e-12)


def test_a_smooth_surface_is_lamberts_to_the_bit() -> None:
    cosine = np.random.default_rng(0).random(1000)
    assert np.array_equal(backscatter(cosine, np.zeros(1000)), cosine)


def test_the_rougher_a_surface_the_more_it_returns_at_a_grazing_angle() -> None:
    returned = backscatter(np.full(20, 0.05), np.linspace(0, 1.5, 20))
    assert (np.diff(returned) > 0).all()
    assert returned.max() < 0.5
