"""The ways back against plain loops, at every border and in every tie."""

import math

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from derain.scan import Bools, Float32s
from derain.views.back_projection import CHUNK, ProjectedPoints, copy, nearest_range, vote

SHAPES = st.tuples(st.integers(1, 7), st.integers(1, 9))


@st.composite
def projections(draw: st.DrawFn) -> tuple[ProjectedPoints, Float32s]:
    """Points on a small grid with few ranges, hence many ties, and a score per pixel."""
    height, width = draw(SHAPES)
    count = draw(st.integers(0, 60))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    pixel = rng.integers(0, height * width, count)
    distance = rng.choice([1.0, 1.5, 2.0, 2.25, 7.0, 7.5, 30.0], count).astype(np.float32)
    points = project(pixel, distance, (height, width), draw(st.booleans()))
    score = rng.random(height * width, np.float32)
    score[rng.random(height * width) < 0.2] = 0.5  # which is no vote for rain
    return points, score


def project(
    pixel: object, distance: object, shape: tuple[int, int], wraps: bool
) -> ProjectedPoints:
    pixel, distance = np.asarray(pixel, np.int64), np.asarray(distance, np.float32)
    nearest = np.full(math.prod(shape), np.inf, np.float32)
    for number, value in zip(pixel, distance, strict=True):
        nearest[number] = min(nearest[number], value)
    return ProjectedPoints(pixel, distance, nearest.reshape(shape), wraps)


def window(points: ProjectedPoints, pixel: int) -> list[tuple[int, int]]:
    """(squared distance, pixel) of a pixel's 5 x 5 window, its own first, then as ties are kept."""
    height, width = points.nearest.shape
    row, column = divmod(pixel, width)
    found = []
    for down in range(-2, 3):
        for right in range(-2, 3):
            there = (column + right) % width if points.wraps else column + right
            if 0 <= row + down < height and 0 <= there < width:
                found.append((down**2 + right**2, (down, right), (row + down) * width + there))
    return [(squared, number) for squared, _, number in sorted(found)]


def nearest_range_by_hand(points: ProjectedPoints, score: Float32s) -> list[float]:
    shown, result = points.nearest.ravel(), []
    for pixel, distance in zip(points.pixel, points.range, strict=True):
        candidates = [number for _, number in window(points, pixel)]
        result.append(score[min(candidates, key=lambda number: abs(shown[number] - distance))])
    return result


def vote_by_hand(points: ProjectedPoints, score: Float32s) -> list[float]:
    shown, result = points.nearest.ravel(), []
    total = sum(math.exp(-(a * a + b * b) / 2) for a in range(-2, 3) for b in range(-2, 3))
    for pixel, distance in zip(points.pixel, points.range, strict=True):
        candidates = []
        for place, (squared, number) in enumerate(window(points, pixel)):
            weight = np.float32(1 - math.exp(-squared / 2) / total)
            difference = np.abs(shown[number] - distance) * weight if place else np.float32(0)
            candidates.append((difference, place, number))
        votes = [score[n] > 0.5 for difference, _, n in sorted(candidates)[:5] if difference <= 1]
        result.append(sum(votes) / len(votes))
    return result


@pytest.mark.parametrize(
    ("back_projection", "by_hand"),
    [
        (nearest_range, nearest_range_by_hand),
        (vote, vote_by_hand),
        (copy, lambda points, score: score[points.pixel]),
    ],
)
@given(projection=projections(), chunk=st.sampled_from([7, CHUNK]))
def test_a_back_projection_equals_plain_loops_in_chunks_of_any_size(
    back_projection, by_hand, projection, chunk
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("derain.views.back_projection.CHUNK", chunk)
        found = back_projection(*projection)
    np.testing.assert_allclose(found, by_hand(*projection), rtol=1e-6)


def test_away_from_the_borders_the_vote_is_the_published_one() -> None:
    rng = np.random.default_rng(2)
    height, width = 16, 40
    pixel, distance = rng.integers(0, height * width, 4000), rng.uniform(1, 12, 4000)
    points = project(pixel, distance, (height, width), False)
    score = rng.random(height * width, np.float32)
    row, column = pixel // width, pixel % width
    inside = (row > 1) & (row < height - 2) & (column > 1) & (column < width - 2)
    assert inside.sum() > 2000
    ours, theirs = vote(points, score)[inside], published_vote(points, score)[inside]
    # torch's topk settles a tied majority by the lower class, as ours does.
    np.testing.assert_array_equal(ours > 0.5, theirs)


def published_vote(points: ProjectedPoints, score: Float32s) -> Bools:
    """RangeNet++'s k-NN search as published: class 0 is void, 1 is other and 2 is rain."""
    shown = torch.from_numpy(np.where(np.isinf(points.nearest), -1, points.nearest))
    classes = torch.from_numpy(np.where(score > 0.5, 2, 1)).reshape(shown.shape)
    classes[shown < 0] = 0

    def patches(image: torch.Tensor) -> torch.Tensor:
        unfolded = torch.nn.functional.unfold(image.float()[None, None], (5, 5), padding=2)
        return unfolded[0][:, torch.from_numpy(points.pixel)]

    ranges, labels = patches(shown), patches(classes)
    ranges[ranges < 0] = torch.inf
    ranges[12] = torch.from_numpy(points.range)
    steps = torch.arange(5) - 2
    bell = torch.exp(-(steps[:, None] ** 2 + steps[None, :] ** 2) / 2.0)
    weighted = (ranges - torch.from_numpy(points.range)).abs()
    weighted *= (1 - bell / bell.sum()).reshape(25, 1)
    nearest, voters = weighted.topk(5, dim=0, largest=False)
    votes = labels.gather(0, voters)
    votes[nearest > 1.0] = 3
    counts = torch.stack([(votes == name).sum(dim=0) for name in range(4)])
    return (counts[1:-1].argmax(dim=0) + 1 == 2).numpy()
