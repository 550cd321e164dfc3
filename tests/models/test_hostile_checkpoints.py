"""A training goes on from sound checkpoints, and refuses hostile and foreign ones in a line."""

from pathlib import Path

import pytest

from benchmarks.fuzzing.checkpoints import HOSTILE, go_on, hostile, trained
from derain.errors import InputError


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "last.ckpt"


def test_a_sound_checkpoint_is_gone_on_from(path: Path) -> None:
    path.write_bytes(trained())
    go_on(path)


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_checkpoint_is_refused_by_its_name(path: Path, name: str) -> None:
    path.write_bytes(hostile(name))
    with pytest.raises(InputError) as refusal:
        go_on(path)
    assert str(refusal.value).startswith(f"{path}: ")
