"""What a run takes over from a checkpoint: states like its own, also under their former names."""

import math
from collections import Counter
from pathlib import Path
from typing import Any

import lightning
import pytest
import torch

from benchmarks.fuzzing.checkpoints import HOSTILE, go_on, hostile, trained
from derain.errors import InputError
from derain.files.documents import Entry
from derain.models.callbacks.best_checkpoint import BestCheckpoint
from derain.models.callbacks.resumption import matching_state
from derain.models.measured import MONITOR
from derain.models.published import read_checkpoint


@pytest.fixture
def path(tmp_path) -> Path:
    return tmp_path / "last.ckpt"


def test_a_sound_checkpoint_is_gone_on_from(path) -> None:
    path.write_bytes(trained())
    go_on(path)


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_checkpoint_is_refused_by_its_name(path, name) -> None:
    path.write_bytes(hostile(name))
    with pytest.raises(InputError) as refusal:
        go_on(path)
    assert str(refusal.value).startswith(f"{path}: ")


def taken(found: Any, own: Any) -> Any:
    return matching_state(Entry("last.ckpt", "lr_schedulers", found), own)


def test_what_a_state_lacks_is_left_out() -> None:
    own = {"last_epoch": 0, "_is_initial": False, "milestones": Counter({3: 1})}
    found = {"last_epoch": 2, "milestones": Counter({3: 1, 5: 1}), "step": "replaces a method"}
    assert taken(found, own) == {"last_epoch": 2, "milestones": Counter({3: 1})}


def test_a_number_may_be_infinite_where_it_is_before_the_first_score() -> None:
    assert taken({"best": 0.25}, {"best": math.inf}) == {"best": 0.25}


@pytest.mark.parametrize(
    ("found", "own"),
    [
        ({}, {"base_lrs": []}),
        ([1], {"base_lrs": []}),
        ({"base_lrs": []}, [1]),
        (2**60, 1),
        ({"best": math.nan}, {"best": math.inf}),
        (math.inf, 0.5),
        (-0.5, 0.5),
        (1.5, 1),
        (True, 1),
        (1, True),
        (5, None),
        ([0.5, 0.5], [0.5]),
        (torch.zeros(1).expand(2**40), torch.zeros(1)),
        (torch.zeros(1, dtype=torch.int64), torch.zeros(1)),
        (torch.zeros(1).to_sparse(), torch.zeros(1)),
    ],
    ids=str,
)
def test_what_is_of_another_kind_is_refused(found, own) -> None:
    with pytest.raises(InputError, match=r"last\.ckpt: lr_schedulers"):
        taken(found, own)


def test_a_checkpoint_of_an_earlier_version_is_read_with_current_names(tmp_path) -> None:
    spec = {"view": {"way_back": "vote"}}  # the key of a Spec stays
    earlier = {
        "hyper_parameters": {"grid": "wads", "way_back": "vote", "spec": spec},
        "callbacks": {"ModelCheckpoint{'monitor': 'val/merit'}": {}, "StepTimes": {}},
        "state_dict": {},
    }
    torch.save(earlier, tmp_path / "earlier.ckpt")
    assert read_checkpoint(tmp_path / "earlier.ckpt") == {
        "hyper_parameters": {"grid": "wads", "back_projection": "vote", "spec": spec},
        "callbacks": {f"ModelCheckpoint{{'monitor': '{MONITOR}'}}": {}, "StepTimes": {}},
        "state_dict": {},
    }


def test_a_monitor_of_an_earlier_configuration_is_followed(tmp_path) -> None:
    callback = BestCheckpoint(tmp_path, monitor="val/merit", mode="max")
    trainer = lightning.Trainer(accelerator="cpu", logger=False, enable_checkpointing=False)
    callback.setup(trainer, lightning.LightningModule(), "fit")
    assert callback.monitor == MONITOR
    assert repr(MONITOR) in callback.state_key
