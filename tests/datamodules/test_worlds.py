"""Simulated worlds are made where they are missing, and read like any other data set."""

from pathlib import Path

import pytest

from derain.datamodules.worlds import Worlds
from derain.errors import InputError
from derain.simulation.world import WorldCampaign
from derain.system.open3d_import import import_open3d


def test_worlds_are_made_once_and_labelled(tmp_path: Path) -> None:
    try:
        import_open3d()
    except InputError as error:
        pytest.skip(str(error))
    world = tmp_path / "small.yaml"
    world.write_text(
        "places: {street: 1}\nhorizon: 0\ncarrier: 0\n"
        "sensors: {kinds: {front: 1}, front_rows: [32], front_step: [0.5, 1.0]}\n"
    )
    campaign = WorldCampaign(train=2, validation=1, world=str(world))
    data = Worlds(str(tmp_path / "made"), campaign, workers=1)
    data.prepare_data()
    counts = {part: len(data.frames(part)) for part in ("train", "validation")}
    assert counts == {"train": 2, "validation": 1}
    made = {file: file.stat().st_mtime_ns for file in (tmp_path / "made").rglob("*.bin")}
    data.prepare_data()
    assert made == {file: file.stat().st_mtime_ns for file in made}
    again = Worlds(str(tmp_path / "made"), make=False)
    assert again.split == {"train": ["00000", "00001"], "validation": ["00002"], "test": []}
    with pytest.raises(InputError, match="no sequence is for test"):
        again.frames("test")
