"""Simulated rain is made where it is missing, and read like any other data set."""

import pytest

from derain.datamodules.base import ScanDataModule
from derain.datamodules.simulated import Simulated
from derain.datamodules.worlds import Worlds
from derain.errors import InputError
from derain.simulation.campaign import Campaign
from derain.simulation.manifest import MAKER, write_manifest
from derain.simulation.sensor import Sensor
from derain.simulation.world import WorldCampaign


@pytest.fixture(params=[Simulated, Worlds])
def data(request, small_world, tmp_path) -> ScanDataModule:
    """A data set of two training sequences and one to validate, of a scan each."""
    root = str(tmp_path / "made")
    if request.param is Worlds:
        campaign = WorldCampaign(train=2, validation=1, world=str(small_world))
        return Worlds(root, campaign, workers=1)
    sensor = Sensor(rows=8, columns=40)
    return Simulated(root, Campaign(2, 1, 0, scans=1, rain_rates=(50.0,), sensor=sensor))


def test_a_data_set_is_made_once_and_labelled(data) -> None:
    data.prepare_data()
    made = {file: file.stat().st_mtime_ns for file in data.root.rglob("*")}
    data.prepare_data()
    again = type(data)(str(data.root), make=False)
    again.prepare_data()
    assert {file: file.stat().st_mtime_ns for file in data.root.rglob("*")} == made
    assert again.split == {part: [*names] for part, names in data.split.items()}
    assert [len(again.frames(part)) for part in ("train", "validation")] == [2, 1]
    assert again.reader.read(again.frames("train")[0]).label is not None
    with pytest.raises(InputError, match="no sequences are named for test"):
        again.frames("test")


def test_what_is_not_to_be_made_must_be_there(tmp_path) -> None:
    with pytest.raises(InputError, match="holds no complete simulated data set"):
        Simulated(str(tmp_path), make=False)
    write_manifest(tmp_path, {"made_by": MAKER, "files": {}})
    with pytest.raises(InputError, match="holds no complete simulated data set"):
        Simulated(str(tmp_path), make=False)
