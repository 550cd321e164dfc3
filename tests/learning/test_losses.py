"""Losses against their definitions, and their values where a scan leaves nothing to learn."""

from itertools import pairwise

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor
from torch.nn.functional import cross_entropy, one_hot

from derain.errors import InputError
from derain.learning.losses import (
    class_weights,
    lovasz_softmax,
    segmentation_loss,
    weighted_cross_entropy,
)

seeds = st.integers(0, 2**32 - 1)


def random_case(
    seed: int, points: int = 12, classes: int = 3, present: int = 3
) -> tuple[Tensor, Tensor]:
    """Logits, float64 (points, classes), and targets among the first ``present`` classes."""
    generator = torch.Generator().manual_seed(seed)
    logits = 2 * torch.randn(points, classes, generator=generator, dtype=torch.float64)
    return logits, torch.randint(present, (points,), generator=generator)


def jaccard_loss(wrong: set[int], members: set[int]) -> float:
    """1 − IoU of a class: its members, and the points got wrong about it."""
    return len(wrong) / len(wrong | members) if wrong else 0.0


def lovasz_by_sets(probability: Tensor, target: Tensor) -> float:
    """Mean over classes of ∫ jaccard_loss({points of error ≥ t}) dt, the Lovász extension."""
    losses = []
    for class_ in set(target.tolist()):
        members = {i for i, t in enumerate(target.tolist()) if t == class_}
        p = probability[:, class_].tolist()
        error = [1 - p[i] if i in members else p[i] for i in range(len(p))]
        loss = 0.0
        for below, level in pairwise(sorted({0.0, *error})):
            wrong = {i for i, e in enumerate(error) if e >= level}
            loss += (level - below) * jaccard_loss(wrong, members)
        losses.append(loss)
    return sum(losses) / len(losses)


@given(seeds, st.integers(1, 12), st.integers(1, 3))
def test_lovasz_is_the_extension_of_the_jaccard_loss(seed: int, points: int, present: int) -> None:
    logits, target = random_case(seed, points, present=present)
    probability = logits.softmax(dim=1)
    expected = lovasz_by_sets(probability, target)
    assert lovasz_softmax(probability, target).item() == pytest.approx(expected, rel=1e-12)


@given(seeds, st.integers(1, 12))
def test_lovasz_survives_equal_errors(seed: int, points: int) -> None:
    logits, target = random_case(seed, points)
    probability = (logits.softmax(dim=1) * 4).round() / 4
    expected = lovasz_by_sets(probability, target)
    assert lovasz_softmax(probability, target).item() == pytest.approx(expected, rel=1e-12)


@given(seeds, st.integers(1, 12))
def test_lovasz_of_hard_predictions_is_one_minus_the_mean_iou(seed: int, points: int) -> None:
    logits, target = random_case(seed, points)
    predicted = logits.argmax(dim=1)
    iou = [
        ((predicted == c) & (target == c)).sum() / ((predicted == c) | (target == c)).sum()
        for c in set(target.tolist())
    ]
    loss = lovasz_softmax(one_hot(predicted, 3).double(), target)
    assert loss.item() == pytest.approx(1 - sum(iou).item() / len(iou), abs=1e-6)


@pytest.mark.parametrize("present", [1, 2, 3])
def test_lovasz_has_the_gradient_of_its_value(present: int) -> None:
    logits, target = random_case(seed=5, present=present)
    assert torch.autograd.gradcheck(
        lambda logits: lovasz_softmax(logits.softmax(dim=1), target), logits.requires_grad_()
    )


def test_lovasz_does_not_depend_on_the_order_of_the_points() -> None:
    logits, target = random_case(seed=1, points=500)
    order = torch.randperm(500, generator=torch.Generator().manual_seed(2))
    probability = logits.softmax(dim=1)
    torch.testing.assert_close(
        lovasz_softmax(probability[order], target[order]), lovasz_softmax(probability, target)
    )


@pytest.mark.parametrize("only", [0, 1], ids=["no rain", "nothing but rain"])
def test_lovasz_of_one_class_is_the_mean_of_what_its_probability_lacks(only: int) -> None:
    logits, _ = random_case(seed=3, points=50, classes=2)
    probability = logits.softmax(dim=1)
    target = torch.full((50,), only)
    torch.testing.assert_close(
        lovasz_softmax(probability, target), (1 - probability[:, only]).mean()
    )


def test_lovasz_keeps_its_digits_in_a_scan_of_400000_points() -> None:
    target = torch.zeros(400_000, dtype=torch.int64)
    target[:100] = 1
    # Steps of 2⁻²², exact in float32; rain on even ones and the rest on odd ones, so no two tie.
    steps = 2 * torch.randperm(2**21, generator=torch.Generator().manual_seed(4))[:400_000]
    rain = (steps + (target == 0)) / 2**22
    gradients = []
    for dtype in (torch.float32, torch.float64):
        probability = torch.stack((1 - rain, rain), dim=1).to(dtype).requires_grad_()
        (gradient,) = torch.autograd.grad(lovasz_softmax(probability, target), probability)
        gradients.append(gradient.double())
    torch.testing.assert_close(gradients[0], gradients[1], rtol=1e-6, atol=0)


def test_cross_entropy_is_torchs_where_that_is_defined() -> None:
    logits, target = random_case(seed=6)
    weight = torch.tensor([1.07, 14.84, 0.5])
    torch.testing.assert_close(
        weighted_cross_entropy(logits, target, weight),
        cross_entropy(logits, target, weight.double()),
    )


def test_cross_entropy_of_classes_without_weight_is_zero() -> None:
    logits, target = random_case(seed=7, present=1)
    logits.requires_grad_()
    loss = weighted_cross_entropy(logits, target, torch.tensor([0.0, 1.0, 1.0]))
    assert loss.item() == 0
    assert not torch.autograd.grad(loss, logits)[0].any()


def test_no_points_give_zero_and_a_gradient() -> None:
    logits = torch.zeros(0, 2, requires_grad=True)
    loss = segmentation_loss(logits, torch.zeros(0, dtype=torch.int64), torch.ones(2))
    assert [part.item() for part in loss] == [0, 0, 0]
    assert torch.autograd.grad(loss.total, logits)[0].shape == (0, 2)


@pytest.mark.parametrize("scale", [0.0, 1.0, 1e4], ids=["constant", "ordinary", "saturated"])
@pytest.mark.parametrize(
    "target",
    [[0], [1], [0] * 8, [1] * 8, [0, 1] * 4],
    ids=["one point", "one raindrop", "no rain", "nothing but rain", "both"],
)
@pytest.mark.parametrize("dtype", [torch.float32, torch.bfloat16])
def test_value_and_gradient_are_finite(scale: float, target: list[int], dtype: torch.dtype) -> None:
    logits, _ = random_case(seed=8, points=len(target), classes=2)
    logits = (scale * logits).to(dtype).requires_grad_()
    loss = segmentation_loss(logits, torch.tensor(target), torch.tensor([1.07, 14.84]))
    assert all(part.isfinite() and part >= 0 for part in loss)
    assert torch.autograd.grad(loss.total, logits)[0].isfinite().all()


def test_autocast_changes_nothing() -> None:
    logits, target = random_case(seed=9, points=3000, classes=2, present=2)
    logits, weight = logits.bfloat16(), torch.tensor([1.07, 14.84])
    expected = segmentation_loss(logits.float(), target, weight)
    with torch.autocast("cpu", dtype=torch.bfloat16):
        under_autocast = segmentation_loss(logits, target, weight)
    assert [part.dtype for part in under_autocast] == [torch.float32] * 3
    assert [part.item() for part in under_autocast] == [part.item() for part in expected]


def test_the_total_is_the_sum_of_its_named_parts() -> None:
    logits, target = random_case(seed=10)
    weight = torch.tensor([1.0, 2.0, 3.0])
    loss = segmentation_loss(logits, target, weight)
    torch.testing.assert_close(loss.total, loss.cross_entropy + loss.lovasz)
    torch.testing.assert_close(loss.cross_entropy, weighted_cross_entropy(logits, target, weight))
    torch.testing.assert_close(loss.lovasz, lovasz_softmax(logits.softmax(dim=1), target))


@given(seeds, st.integers(0, 40), st.integers(1, 2))
def test_the_short_way_of_two_classes_is_the_sum_of_the_general_losses(
    seed: int, points: int, present: int
) -> None:
    logits, target = random_case(seed, points, classes=2, present=present)
    weight = torch.tensor([1.07, 14.84])
    short = segmentation_loss(logits.requires_grad_(), target, weight)
    cross_entropy = weighted_cross_entropy(logits, target, weight)
    lovasz = lovasz_softmax(logits.softmax(dim=1), target)
    torch.testing.assert_close(short.cross_entropy, cross_entropy)
    torch.testing.assert_close(short.lovasz, lovasz)
    expected = torch.autograd.grad(cross_entropy + lovasz, logits)
    torch.testing.assert_close(torch.autograd.grad(short.total, logits), expected)


def test_descending_the_loss_finds_the_rare_class() -> None:
    _, target = random_case(seed=11, points=200, present=2)
    target[:190] = 0
    logits = torch.zeros(200, 2, requires_grad=True)
    for _ in range(20):
        loss = segmentation_loss(logits, target, class_weights([0.95, 0.05]))
        with torch.no_grad():
            logits -= 50 * torch.autograd.grad(loss.total, logits)[0]
    assert torch.equal(logits.argmax(dim=1), target)


@pytest.mark.parametrize(
    ("points", "published"),
    [
        # Points by class in 3D-OutDet's configurations, and the weights it makes of them.
        ((117_368_406, 15_966_358), (1.135, 8.282)),  # WADS
        ((0.9, 0.1), (1.110, 9.901)),  # SnowyKITTI
        ((196_553_910 + 1_618_805, 2_435_157), (1.011, 76.1)),  # SemanticSpray
        ((0.93361355634800304, 0.06638644365199696), (1.070, 14.840)),  # REHEARSE-3D
    ],
    ids=["WADS", "SnowyKITTI", "SemanticSpray", "REHEARSE-3D"],
)
def test_class_weights_are_the_published_ones(
    points: tuple[float, float], published: tuple[float, float]
) -> None:
    weights = class_weights([count / sum(points) for count in points])
    assert weights.tolist() == pytest.approx(published, rel=5e-4)


def test_a_class_without_points_keeps_a_finite_weight() -> None:
    assert class_weights([1.0, 0.0]).tolist() == pytest.approx([1 / 1.001, 1000])
    assert class_weights([1.0, 0.0], floor=0.01)[1].item() == pytest.approx(100)


@pytest.mark.parametrize("share", [-0.1, 1.1, float("nan")])
def test_a_share_that_is_none_is_refused(share: float) -> None:
    with pytest.raises(InputError, match="class shares"):
        class_weights([1.0, share])
