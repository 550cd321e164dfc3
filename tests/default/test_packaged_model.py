"""The model that comes with derain: it is the one of its card, or it is refused."""

import hashlib
import shutil
from dataclasses import asdict
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

import derain
from derain import default
from derain.default import DEFAULT, default_checkpoint, default_model, model_card
from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.export.methods import load_method
from derain.export.proof import prove
from derain.models.checkpoint import load_model
from derain.scan import Scan

# What the file may weigh, bytes: it is in every installation.
LARGEST = 2_000_000


@pytest.fixture
def installed(tmp_path, monkeypatch) -> Path:
    """A copy of the model's folder, in place of the installed one."""
    folder = tmp_path / "installed"
    folder.mkdir()
    for name in ("model.onnx", "model.ckpt", "card.yaml"):
        shutil.copy(Path(str(resources.files("derain.default"))) / name, folder)
    monkeypatch.setattr(default, "FOLDER", folder)
    return folder


def test_the_file_is_that_of_the_card_and_small() -> None:
    assert default_model().stat().st_size <= LARGEST
    spec = derain.Derainer(threads=1).spec
    card = model_card()
    assert (spec.threshold, spec.licence, spec.data) == (card.threshold, card.licence, card.data)
    assert card.name == DEFAULT


def test_without_a_name_it_is_the_model_and_judges_as_its_file_does() -> None:
    own, by_path = derain.Derainer(threads=1), derain.Derainer(default_model(), threads=1)
    by_name = load_method(DEFAULT, {}, 1)
    points = scene(2000)
    np.testing.assert_array_equal(own.probability(points), by_path.probability(points))
    np.testing.assert_array_equal(own(points), by_name.push(points).rain)
    assert (
        own.as_dict() == by_name.as_dict() == {"method": DEFAULT, "threshold": own.spec.threshold}
    )
    assert by_path.as_dict()["method"] == str(default_model())


@pytest.mark.parametrize(
    "change",
    [
        lambda _: b"",
        lambda model: model + b"more",
        lambda model: model[:1000] + model[1001:] + b"1",
    ],
    ids=["emptied", "longer", "as long"],
)
def test_a_changed_file_is_refused(installed, change) -> None:
    model = installed / "model.onnx"
    model.write_bytes(change(model.read_bytes()))
    with pytest.raises(InputError) as refused:
        derain.Derainer()
    text = str(refused.value)
    assert text.startswith(f"{model}: it is not the model that came with derain: its SHA-256")
    assert "Install derain again" in text


@pytest.mark.parametrize(
    ("name", "find"),
    [
        ("model.onnx", default_model),
        ("model.ckpt", default_checkpoint),
        ("card.yaml", model_card),
        ("card.yaml", default_model),
    ],
)
def test_a_missing_file_is_named(installed, name, find) -> None:
    (installed / name).unlink()
    with pytest.raises(InputError, match=r"model that comes with derain is missing\. Install"):
        find()


def test_the_checkpoint_is_of_the_same_model() -> None:
    model, derainer = load_model(default_checkpoint()).eval(), derain.Derainer(threads=1)
    drops = np.random.default_rng(0).uniform(-8, 8, (200, 4))
    scan = Scan.of(np.concatenate([scene(2000), drops]))
    proof = prove(model, default_model(), [("drops", scan), *hard_cases(largest=3000)])
    assert proof.holds, proof
    assert 0 < derainer(scan).sum() < len(scan)
    assert model.spec.as_dict() == derainer.spec.as_dict()


def test_the_card_states_everything_and_scores_are_shares() -> None:
    card = model_card()
    assert card.sha256 == hashlib.sha256(default_model().read_bytes()).hexdigest()
    assert all(asdict(card)[name] for name in ("version", "what", "training", "not_for", "scores"))
    for score in card.scores:
        assert score.keys() - {"data"} <= {"iou", "taken"}
        assert score["data"]
        assert all(0 <= score[name] <= 1 for name in score.keys() - {"data"})
