"""There is no scan that a model cannot take a training step on."""

from collections.abc import Callable

import numpy as np
import pytest
import torch

from derain.evaluation.hard_cases import hard_cases, scene
from derain.learning.batch import Batch, Sample
from derain.learning.losses import segmentation_loss
from derain.models.outdet import OutDet
from derain.scan import Scan

HARD_CASES = dict(hard_cases(largest=5000))
MakeModel = Callable[..., OutDet]
MakeSample = Callable[..., Sample]


def step(model: OutDet, batch: Batch) -> None:
    """Takes a training step and looks at everything in it."""
    model.train()
    optimizer = torch.optim.Adam(model.parameters())
    assert batch.target is not None
    loss = segmentation_loss(model(**batch.inputs), batch.target, model.class_weight).total
    loss.backward()
    assert loss.isfinite()
    for parameter in model.parameters():
        assert parameter.grad is not None
        assert parameter.grad.isfinite().all()
    optimizer.step()
    assert all(tensor.isfinite().all() for tensor in model.state_dict().values())


@pytest.mark.parametrize("rain", [0.0, 0.3, 1.0], ids=["no rain", "some rain", "nothing but rain"])
@pytest.mark.parametrize("points", [0, 1, 2, 5, 300])
def test_every_number_of_points_and_share_of_rain_can_be_learnt_from(
    outdet: MakeModel, sample: MakeSample, points: int, rain: float
) -> None:
    step(outdet(), Batch.of([sample(scene(300)[:points], rain=rain)]))


@pytest.mark.parametrize("scan", HARD_CASES.values(), ids=HARD_CASES)
def test_a_hard_scan_can_be_learnt_from_and_judged(
    outdet: MakeModel, sample: MakeSample, scan: Scan
) -> None:
    model, batch = outdet(), Batch.of([sample(scan)])
    step(model, batch)
    model.eval()
    (probability,) = model.probabilities(batch, model(**batch.inputs).detach())
    assert probability.shape == (len(scan),)
    assert np.isfinite(probability).all()
    assert (probability[~scan.valid] == 0).all()


def test_all_hard_scans_at_once_can_be_learnt_from(outdet: MakeModel, sample: MakeSample) -> None:
    step(outdet(), Batch.of([sample(scan) for scan in HARD_CASES.values()]))


def test_fewer_than_two_points_leave_the_running_statistics_alone(
    outdet: MakeModel, sample: MakeSample
) -> None:
    model = outdet()
    before = {name: tensor.clone() for name, tensor in model.network.norm1.named_buffers()}
    for points in (0, 1):
        step(model, Batch.of([sample(scene(300)[:points])]))
    for name, tensor in model.network.norm1.named_buffers():
        assert torch.equal(tensor, before[name])
