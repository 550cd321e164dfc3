"""A network judges scans together as alone; there is none that it cannot learn from and judge."""

import pytest
import torch

from derain.evaluation.hard_cases import hard_cases, scene
from derain.learning.batch import Batch, Sample
from derain.models.base import DerainingModule
from derain.models.lisnownet import LiSnowNet
from derain.models.outdet import OutDet
from derain.models.salsanext import SalsaNext
from derain.models.salsanext_lite import SalsaNextLite
from derain.scan import Scan

FEW = {f"{points} points": Scan.of(scene(300)[:points]) for points in (0, 1, 2, 5)}
HARD_CASES = {**dict(hard_cases(largest=5000)), **FEW}


@pytest.fixture(params=[OutDet, SalsaNext, SalsaNextLite, LiSnowNet])
def model(request, outdet, image_network) -> DerainingModule:
    """A network of random weights."""
    return outdet() if request.param is OutDet else image_network(request.param)


@torch.no_grad()
def test_packed_scans_get_the_logits_they_get_alone(model, sample) -> None:
    def logits_of(*together: Sample) -> torch.Tensor:
        inputs = Batch.of(together).inputs
        wide = {n: t.double() if t.is_floating_point() else t for n, t in inputs.items()}
        return model.double()(**wide)

    samples = [sample(model, scene(points, points)) for points in (300, 0, 7, 1, 3000)]
    for logits, own in zip(Batch.of(samples).split(logits_of(*samples)), samples, strict=True):
        torch.testing.assert_close(logits, logits_of(own), atol=1e-8, rtol=1e-8)


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
        assert parameter.grad.isfinite().all()
    optimizer.step()
    assert all(tensor.isfinite().all() for tensor in model.state_dict().values())


@pytest.mark.parametrize("scan", HARD_CASES.values(), ids=HARD_CASES)
def test_a_hard_scan_can_be_learnt_from_and_judged(model, sample, scan) -> None:
    batch = Batch.of([sample(model, scan)])
    step(model, batch)
    model.eval()
    with torch.no_grad():
        losses, logits = model.losses(batch)
    assert all(loss.isfinite() for loss in losses.values())
    (probability,) = model.probabilities(batch, logits)
    assert probability.shape == (len(scan),)
    assert ((probability >= 0) & (probability <= 1)).all()
    assert (probability[~scan.valid] == 0).all()


@pytest.mark.parametrize(
    "name", ["empty", "one point", "near and far together", "constant image", "intensity 65,535"]
)
def test_a_hard_scan_can_be_learnt_from_in_bfloat16(model, sample, name) -> None:
    step(model, Batch.of([sample(model, HARD_CASES[name])]), bfloat16=True)


@pytest.mark.parametrize("rain", [0.0, 1.0], ids=["no rain", "nothing but rain"])
def test_hard_scans_of_one_class_can_be_learnt_from_together(model, sample, rain) -> None:
    step(model, Batch.of([sample(model, scan, rain) for scan in HARD_CASES.values()]))


def test_fewer_than_two_points_leave_the_running_statistics_alone(outdet, sample) -> None:
    model = outdet()
    before = {name: tensor.clone() for name, tensor in model.network.norm1.named_buffers()}
    for points in (0, 1):
        step(model, Batch.of([sample(model, scene(300)[:points])]))
    for name, tensor in model.network.norm1.named_buffers():
        assert torch.equal(tensor, before[name])
