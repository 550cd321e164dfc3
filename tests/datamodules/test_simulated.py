"""Simulated rain is made where it is missing, and read like any other data set."""

from dataclasses import replace
from pathlib import Path

import pytest

from derain.datamodules.simulated import Simulated
from derain.errors import InputError
from derain.simulation.campaign import Campaign
from derain.simulation.dataset import simulate_track
from derain.simulation.manifest import MAKER, write_manifest
from derain.simulation.sensor import Sensor
from derain.system.open3d_import import import_open3d

TINY = Campaign(
    train=2,
    validation=1,
    test=1,
    scans=2,
    rain_rates=(50.0,),
    sensor=Sensor(rows=8, columns=40),
)


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    try:
        import_open3d()
    except InputError as error:
        pytest.skip(str(error))
    root = tmp_path_factory.mktemp("simulated") / "track"
    Simulated(str(root), TINY).prepare_data()
    return root


def test_every_part_has_its_sequences_and_every_scan_its_labels(root: Path) -> None:
    data = Simulated(str(root), TINY)
    counts = {part: len(data.frames(part)) for part in ("train", "validation", "test", "predict")}
    assert counts == {"train": 4, "validation": 2, "test": 2, "predict": 2}
    sequences = {
        frame.sequence for part in ("train", "validation", "test") for frame in data.frames(part)
    }
    assert sequences == {"000", "001", "002", "003"}
    scan = data.read(data.frames("train")[0])
    assert scan.label is not None
    assert (scan.label == 3).any()


def test_the_card_gets_its_statistics_from_the_training_scans(root: Path) -> None:
    data = Simulated(str(root), TINY)
    assert not data.card.has_statistics
    data.complete_card()
    assert data.card.has_statistics
    assert 0 < data.card.rain_share < 0.5


@pytest.mark.parametrize("make", [True, False])
def test_a_data_set_that_is_there_is_taken_as_it_is(root: Path, make: bool) -> None:
    data = Simulated(str(root), TINY) if make else Simulated(str(root), make=False)
    before = {file: file.stat().st_mtime_ns for file in root.rglob("*")}
    data.prepare_data()
    assert {file: file.stat().st_mtime_ns for file in root.rglob("*")} == before
    assert data.split == TINY.split
    assert len(data.frames("train")) == 4


def test_what_is_not_to_be_made_must_be_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no complete simulated data set"):
        Simulated(str(tmp_path), make=False)
    write_manifest(tmp_path, {"made_by": MAKER, "files": {}})
    with pytest.raises(InputError, match="holds no complete simulated data set"):
        Simulated(str(tmp_path), make=False)


def test_what_a_person_simulated_is_not_replaced(root: Path, tmp_path: Path) -> None:
    simulate_track(tmp_path / "mine", TINY)
    before = (tmp_path / "mine/manifest.json").read_bytes()
    with pytest.raises(InputError, match="Name another folder"):
        Simulated(str(tmp_path / "mine"), replace(TINY, seed=1)).prepare_data()
    assert (tmp_path / "mine/manifest.json").read_bytes() == before


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(InputError, match="holds something other than a simulated data set"):
        Simulated(str(tmp_path), TINY).prepare_data()
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]
