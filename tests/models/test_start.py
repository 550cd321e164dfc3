"""A training that begins from a trained model starts with its answers."""

from collections.abc import Callable
from dataclasses import replace

import lightning
import numpy as np
import pytest
import torch

from derain.cards.card import DataCard
from derain.datamodules.in_memory import InMemory
from derain.datamodules.mixture import Mixture
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.learning.batch import Batch
from derain.learning.start import STARTED_FROM
from derain.learning.task import agree_on_task
from derain.models.base import DerainingModule
from derain.models.checkpoint import load_model, save_model, started
from derain.models.outdet import OutDet
from derain.models.salsanext import SalsaNext
from derain.scan import Scan

FIRST = DataCard("first", {0: "ground", 1: "rain"}, rain=(1,), licence="free")
OTHER = DataCard("other", {0: "rain", 5: "road"}, rain=(0,), licence="dear")
GRID = {"rows": 16, "columns": 64, "inclination": [-30.0, 20.0]}


def data(card: DataCard, first: int, shift: float = 0.0) -> InMemory:
    """Three scans of 300 points, the last a drop in ten, moved a little to have statistics."""
    drop, other = card.rain[0], next(id_ for id_ in card.classes if id_ not in card.rain)
    label = np.where(np.arange(300) < 270, other, drop)
    scans = [
        replace(scan := Scan.of(scene(300, seed)), xyz=scan.xyz + np.float32(shift))
        for seed in range(first, first + 3)
    ]
    return InMemory(*([scan.with_label(label) for scan in scans],) * 3, card=card)


@pytest.fixture
def trained(make_trainer, tmp_path) -> Callable[..., DerainingModule]:
    """Has a model learn a little, and saves it with its Spec."""

    def train(
        model: DerainingModule, card: DataCard = FIRST, first: int = 0, name: str = "start.ckpt"
    ) -> DerainingModule:
        lightning.seed_everything(first)
        make_trainer(epochs=2).fit(model, data(card, first))
        save_model(model, tmp_path / name)
        return load_model(tmp_path / name)

    return train


MODELS = {
    "outdet": (OutDet(neighbours=4, channels=("range",)), OutDet(learning_rate=0.02)),
    "salsanext": (SalsaNext(GRID, width=4, channels=("range", "z")), SalsaNext(momentum=0.5)),
}


@pytest.mark.parametrize("kind", MODELS)
def test_the_first_logits_are_those_of_the_start(kind, trained, tmp_path) -> None:
    first, recipe = MODELS[kind]
    source = trained(first)
    student = started(recipe, tmp_path / "start.ckpt", "mine")
    # Other scans with other statistics, which would normalise the input in another way.
    own = data(OTHER, 10, shift=3.0)
    agree_on_task(student, own)
    student.eval()
    batch: Batch = next(iter(own.val_dataloader()))
    with torch.no_grad():
        ours, theirs = student(**batch.inputs), source(**batch.inputs)
    torch.testing.assert_close(ours, theirs, rtol=0, atol=0)
    assert theirs.std() > 0

    spec, start = student.spec, source.spec
    for name in ("view", "channels", "units", "mean", "std"):
        assert getattr(spec, name) == getattr(start, name)
    assert (spec.data, spec.rain, spec.classes) == ("other", (0,), OTHER.classes)
    assert spec.licence == "dear; started from first (free)"
    for argument in recipe.RECIPE:
        assert student.hparams.get(argument) == recipe.hparams.get(argument)


def test_the_record_names_what_it_began_from_and_all_that_both_have_seen(trained, tmp_path) -> None:
    source = trained(OutDet(neighbours=3), name="one.ckpt")
    student = started(OutDet(), tmp_path / "one.ckpt", "one")
    (one,) = agree_on_task(student, data(OTHER, 10)).spec.training[STARTED_FROM]
    assert one.startswith("one (")
    prints = {*source.spec.training["scans"], *data(OTHER, 10).training_record()["scans"]}
    assert {*student.spec.training["scans"]} == prints
    assert len(prints) == 6
    # And so on: a student of the student.
    save_model(student, tmp_path / "two.ckpt")
    mixture = Mixture({"first": data(FIRST, 0), "new": data(FIRST, 20)})
    last = agree_on_task(started(OutDet(), tmp_path / "two.ckpt", "two"), mixture).spec
    assert [name.split(" (")[0] for name in last.training[STARTED_FROM]] == ["one", "two"]
    assert len(last.training["scans"]) == 9


def test_a_student_that_is_read_back_is_as_it_was(trained, tmp_path) -> None:
    trained(OutDet(neighbours=4, channels=("range",)))
    student = started(OutDet(learning_rate=0.02), tmp_path / "start.ckpt", "mine")
    again = trained(student, OTHER, 10, "student.ckpt")
    assert again.hparams["neighbours"] == 4
    assert again.hparams["learning_rate"] == 0.02
    assert again.spec == student.spec


def test_it_starts_from_a_model_of_its_own_kind_alone(trained, tmp_path) -> None:
    trained(OutDet(neighbours=3))
    with pytest.raises(InputError, match="a model of outdet, from which salsanext cannot start"):
        started(SalsaNext(), tmp_path / "start.ckpt", "mine")
