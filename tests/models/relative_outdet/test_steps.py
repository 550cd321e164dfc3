"""Neighbourhoods in steps of the sensor's beams: what does not change from sensor to sensor."""

import numpy as np
import pytest
import torch
from torch import Tensor

from derain.models.relative_outdet.network import in_steps
from derain.views.neighbour_search import NeighbourSearch

from .beams import sphere


def seen(xyz: np.ndarray, k: int = 9) -> tuple[Tensor, Tensor]:
    neighbours, distances = NeighbourSearch(xyz, threads=1)(k)
    return in_steps(*map(torch.from_numpy, (xyz, distances, neighbours)))


def test_a_step_of_even_beams_is_one_step() -> None:
    around, far = seen(sphere(40, 60, 0.004, 20.0))
    middle = slice(1000, 1400)
    nearest = torch.exp(around[middle, :4, 0])
    # The four nearest are a step away, and log(1 + .01) is what they are seen at.
    torch.testing.assert_close(nearest.median(), torch.tensor(1.01), atol=0.02, rtol=0)
    assert around[middle, :4, 1].abs().max() < 0.05  # none is farther from the sensor
    torch.testing.assert_close(far[middle], torch.log(torch.full((400,), 2.0)))


@pytest.mark.parametrize("scale", [0.25, 4.0])
def test_what_is_seen_does_not_depend_on_how_far_the_scene_is(scale: float) -> None:
    generator = np.random.default_rng(0)
    xyz = sphere(20, 40, 0.01, 12.0) * generator.uniform(0.9, 1.1, (800, 1)).astype(np.float32)
    near, here = seen(xyz)
    other, there = seen((scale * xyz).astype(np.float32))
    torch.testing.assert_close(near, other, atol=2e-3, rtol=2e-3)
    torch.testing.assert_close(there - here, torch.full((800,), float(np.log(scale))))


def test_what_is_seen_does_not_depend_on_where_the_sensor_looks() -> None:
    xyz = np.random.default_rng(1).normal(0, 10, (500, 3)).astype(np.float32)
    angle = 2.0
    turn = np.array(
        [[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    mirror = np.diag([1.0, -1.0, 1.0])
    for change in (turn, mirror):
        torch.testing.assert_close(
            seen(xyz)[0], seen((xyz @ change).astype(np.float32))[0], atol=5e-3, rtol=5e-3
        )


def test_a_drop_in_front_of_a_wall_is_many_steps_from_everything() -> None:
    wall = sphere(40, 60, 0.004, 20.0)
    drop = np.array([[8.0, 0, 0]], np.float32)
    around, _ = seen(np.concatenate([wall, drop]))
    assert torch.exp(around[-1, 0, 0]) > 100
    assert (around[-1, :, 1] > 5).all()  # all of it is farther off
    assert torch.exp(around[:-1, 0, 0]).median() < 1.1


@pytest.mark.parametrize("points", [0, 1, 2, 5])
def test_few_points_give_finite_numbers(points: int) -> None:
    around, far = seen(np.random.default_rng(0).normal(0, 5, (points, 3)).astype(np.float32))
    assert around.shape == (points, 8, 4)
    assert torch.isfinite(around).all()
    assert torch.isfinite(far).all()
