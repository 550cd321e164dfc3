"""What a model and its data agree on: each gives what it knows, once."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from derain.cards.card import DataCard, load_card
from derain.datamodules.in_memory import InMemory
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.learning.task import EXAMPLE_SCANS, agree_on_task
from derain.models.lisnownet import LiSnowNet
from derain.models.outdet import OutDet
from derain.models.salsanext import SalsaNext
from derain.scan import Scan
from derain.sources.training_record import record_of_scans

CARD = DataCard("ours", {0: "ground", 3: "rain"}, rain=(3,))
GRID = {"rows": 16, "columns": 64, "inclination": [-30.0, 20.0]}


def scans(number: int, labelled: bool = True, **fields: Any) -> list[Scan]:
    """Scans of which every fourth point is rain."""
    made = [replace(Scan.of(scene(200, seed=seed)), fields=fields) for seed in range(number)]
    return [scan.with_label(np.resize([3, 0, 0, 0], 200)) if labelled else scan for scan in made]


def test_both_are_given_the_card_that_the_training_scans_complete() -> None:
    model, data = OutDet(), InMemory(scans(3), card=CARD)
    task = agree_on_task(model, data)
    assert data.task is task
    assert model.card is data.card is task.card
    assert model.spec is task.spec
    points = np.concatenate([scene(200, seed=seed) for seed in range(3)]).astype(np.float64)
    np.testing.assert_allclose(task.spec.mean, points.mean(axis=0))
    np.testing.assert_allclose(task.spec.std, points.std(axis=0))
    assert task.card.rain_share == 0.25
    assert task.spec.training == record_of_scans(data.source("train"))
    assert task.reads_labels


def test_the_view_is_fitted_to_training_scans() -> None:
    data = InMemory(scans(3), card=CARD)
    task = agree_on_task(SalsaNext(width=4), data)
    fitted = SalsaNext(width=4).spec_for(data.card, list(data.training_scans(EXAMPLE_SCANS)))
    assert task.spec.view == fitted.view


def test_a_model_that_learns_from_no_labels_reads_none() -> None:
    data = InMemory(scans(2, labelled=False), card=CARD)
    task = agree_on_task(LiSnowNet(GRID, width=2), data)
    assert not task.reads_labels
    assert task.card.rain_share is None
    with pytest.raises(InputError, match="it has no labels"):
        agree_on_task(OutDet(), data)


def test_columns_are_those_that_the_model_names() -> None:
    column = np.arange(200, dtype=np.float32)
    data = InMemory(scans(2, echo=column, ring=column), card=CARD)
    task = agree_on_task(OutDet(channels=("x", "y", "z", "echo")), data)
    assert task.columns == ("echo",)
    assert set(data.reader.read(data.frames("train")[0]).fields) == {"echo"}
    assert task.spec.mean[3] == column.mean()
    assert agree_on_task(OutDet(), InMemory(scans(2, echo=column), card=CARD)).columns == ()


def test_a_spec_that_is_there_has_the_last_word() -> None:
    model, data = OutDet(), InMemory(scans(2), test=scans(1), card=CARD)
    model.adopt(model.spec_for(load_card("wads")))
    spec = model.spec
    for training in (False, True):
        assert agree_on_task(model, data, training).spec is spec
        assert model.card is data.card
    assert data.card.has_statistics  # of the data that it learns from now, for the loss


def test_to_be_measured_a_model_must_have_been_trained() -> None:
    data = InMemory(test=scans(1), card=CARD)
    with pytest.raises(InputError, match="has not been trained"):
        agree_on_task(OutDet(), data, training=False)
    assert data.task is None
    with pytest.raises(InputError, match=r"has not been trained\. Give a checkpoint"):
        data.test_dataloader()
