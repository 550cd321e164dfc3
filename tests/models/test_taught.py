"""What withstands a teacher's errors, and what it does not know."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import torch

from derain.cards.card import DataCard
from derain.datamodules.in_memory import InMemory
from derain.evaluation.hard_cases import scene
from derain.learning.batch import Batch, Sample
from derain.learning.losses import class_weights
from derain.learning.task import agree_on_task
from derain.models.outdet import OutDet
from derain.models.salsanext import SalsaNext
from derain.models.supervised import SupervisedModule
from derain.scan import Scan

CARD = DataCard("taught", {0: "not rain", 1: "rain", 255: "not known"}, (1,), unknown=(255,))


def taught(seed: int) -> Scan:
    """A scene whose drops are rain; of every fourth point the teacher does not know."""
    label = (np.arange(400) >= 360).astype(np.int64)
    label[::4] = 255
    return Scan.of(scene(400, seed)).with_label(label)


MakeModel = Callable[..., SupervisedModule]


@pytest.fixture(params=["outdet", "salsanext"])
def make(request, small_grid) -> MakeModel:
    if request.param == "outdet":
        return OutDet
    return lambda **options: SalsaNext(grid=small_grid, width=4, **options)


def test_the_rarer_class_weighs_as_much_more_as_the_option_states(make) -> None:
    scans = [taught(seed) for seed in range(2)]
    weights = {}
    for balance in (0.0, 0.5, 1.0):
        model = make(balance=balance)
        agree_on_task(model, InMemory(train=scans, card=CARD))
        weights[balance] = model.class_weight
    share = 30 / 300  # of the points that are known
    assert torch.equal(weights[1.0], class_weights([1 - share, share]))
    torch.testing.assert_close(weights[0.5] ** 2, weights[1.0])
    assert torch.equal(weights[0.0], torch.ones(2))


def test_what_is_not_known_moves_no_weight(make) -> None:
    scan = taught(0)
    unknown = scan.label == 255
    losses = []
    for model_finds_rain in (False, True):
        model = make()
        agree_on_task(model, InMemory(train=[scan], card=CARD))
        view = model.spec.make_view()(scan)
        batch = Batch.of([Sample.of(scan, view, CARD)])
        of_unknown = torch.from_numpy(view.target(unknown) == 1)
        logits = torch.zeros(view.size, 2)
        logits[of_unknown, int(model_finds_rain)] = 5.0
        logits.requires_grad_()
        loss = model.segmentation_loss(logits, batch.target).loss
        loss.backward()
        assert of_unknown.any()
        assert not logits.grad[of_unknown].any()
        assert logits.grad[~of_unknown].any()
        losses.append(loss.item())
    assert losses[0] == losses[1]


def test_candidates_are_fitted_to_what_is_known() -> None:
    scans = [taught(seed) for seed in range(4)]
    # Unknown points of no rain's range and intensity, were they called rain.
    far = [replace(s, xyz=np.where((s.label == 255)[:, None], 80, s.xyz)) for s in scans]
    fitted = []
    for given in (scans, far):
        model = OutDet(candidates=0.9)
        agree_on_task(model, InMemory(train=given, card=CARD))
        assert model.spec.candidates is not None
        fitted.append(model.spec.candidates)
    assert fitted[0] == fitted[1]
