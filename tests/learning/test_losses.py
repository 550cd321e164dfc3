"""Losses against their definitions, and their values where a scan leaves nothing to learn."""

from itertools import pairwise

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor
from torch.nn.functional import cross_entropy

from derain.learning.losses import class_weights, segmentation_loss

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


@given(seeds, st.integers(1, 12), st.integers(1, 2), st.sampled_from([1, 4, None]), st.booleans())
def test_lovasz_is_the_extension_of_the_jaccard_loss(seed, points, present, steps, swapped) -> None:
    logits, target = random_case(seed, points, classes=2, present=present)
    target = 1 - target if swapped else target
    if steps is not None:  # equal errors
        logits = (logits * steps).round() / steps
    expected = lovasz_by_sets(logits.softmax(dim=1), target)
    loss = segmentation_loss(logits, target, torch.ones(2))
    assert loss.lovasz.item() == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("part", [0, 1, 2])
@pytest.mark.parametrize("present", [1, 2])
def test_the_loss_and_its_parts_have_the_gradients_of_their_values(part, present) -> None:
    logits, target = random_case(seed=5, classes=2, present=present)
    weight = torch.tensor([1.07, 14.84])
    assert torch.autograd.gradcheck(
        lambda logits: segmentation_loss(logits, target, weight)[part], logits.requires_grad_()
    )


def test_lovasz_keeps_its_digits_in_a_scan_of_400000_points() -> None:
    target = torch.zeros(400_000, dtype=torch.int64)
    target[:100] = 1
    # Exact in float32, and no two errors tie.
    steps = torch.randperm(2**21, generator=torch.Generator().manual_seed(4))[:400_000]
    wrong = (steps - 2**20) / 2**19
    lean = torch.where(target == 1, -wrong, wrong)
    gradients = []
    for dtype in (torch.float32, torch.float64):
        logits = torch.stack((torch.zeros_like(lean), lean), dim=1).to(dtype).requires_grad_()
        lovasz = segmentation_loss(logits, target, torch.ones(2)).lovasz
        (gradient,) = torch.autograd.grad(lovasz, logits)
        gradients.append(gradient.double())
    torch.testing.assert_close(gradients[0], gradients[1], rtol=1e-6, atol=0)


@given(seeds, st.integers(1, 40))
def test_cross_entropy_is_torchs_where_that_is_defined(seed, points) -> None:
    logits, target = random_case(seed, points, classes=2, present=2)
    weight = torch.tensor([1.07, 14.84])
    loss = segmentation_loss(logits, target, weight)
    torch.testing.assert_close(loss.cross_entropy, cross_entropy(logits, target, weight.double()))
    torch.testing.assert_close(loss.loss, loss.cross_entropy + loss.lovasz)


def test_cross_entropy_is_zero_of_classes_without_weight() -> None:
    logits, target = random_case(seed=6, classes=2, present=2)
    loss = segmentation_loss(logits.requires_grad_(), target, torch.zeros(2)).cross_entropy
    assert loss.item() == 0
    assert not torch.autograd.grad(loss, logits)[0].any()


def test_no_points_give_zero_and_a_gradient() -> None:
    logits = torch.zeros(0, 2, requires_grad=True)
    loss = segmentation_loss(logits, torch.zeros(0, dtype=torch.int64), torch.ones(2))
    assert [part.item() for part in loss] == [0, 0, 0]
    assert torch.autograd.grad(loss.loss, logits)[0].shape == (0, 2)


@pytest.mark.parametrize("scale", [0.0, 1.0, 1e4], ids=["constant", "ordinary", "saturated"])
@pytest.mark.parametrize(
    "target",
    [[0], [1], [0] * 8, [1] * 8, [0, 1] * 4],
    ids=["one point", "one raindrop", "no rain", "nothing but rain", "both"],
)
@pytest.mark.parametrize("dtype", [torch.float32, torch.bfloat16])
def test_value_and_gradient_are_finite(scale, target, dtype) -> None:
    logits, _ = random_case(seed=8, points=len(target), classes=2)
    logits = (scale * logits).to(dtype).requires_grad_()
    loss = segmentation_loss(logits, torch.tensor(target), torch.tensor([1.07, 14.84]))
    assert all(part.isfinite() and part >= 0 for part in loss)
    assert torch.autograd.grad(loss.loss, logits)[0].isfinite().all()


def test_autocast_changes_nothing() -> None:
    logits, target = random_case(seed=9, points=3000, classes=2, present=2)
    logits, weight = logits.bfloat16(), torch.tensor([1.07, 14.84])
    expected = segmentation_loss(logits.float(), target, weight)
    with torch.autocast("cpu", dtype=torch.bfloat16):
        under_autocast = segmentation_loss(logits, target, weight)
    assert [part.dtype for part in under_autocast] == [torch.float32] * 3
    assert [part.item() for part in under_autocast] == [part.item() for part in expected]


def test_the_weight_of_a_class_that_never_occurs_is_finite() -> None:
    assert class_weights([1, 0]).tolist() == pytest.approx([1 / 1.001, 1000])
