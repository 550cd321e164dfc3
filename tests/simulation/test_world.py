"""The training world: drawn by its spans, the same by its seed, refused where impossible."""

from pathlib import Path

import numpy as np
import pytest

from derain.errors import InputError
from derain.files.documents import Entry
from derain.simulation.classes import TrackClass
from derain.simulation.dataset import simulate_track
from derain.simulation.layouts import LAYOUTS
from derain.simulation.world import World, WorldCampaign, draw_scan, load_world
from derain.system.open3d_import import import_open3d

# Quick to simulate: a bare street, seen by few beams.
SMALL = """
places: {street: 1}
horizon: 0
carrier: 0
sensors: {kinds: {spinning: 1}, spinning_rows: [16], azimuth_step: [1.0, 1.5]}
precipitation: {snow: {weight: 1, crowding: [0.1, 0.3]}}
"""


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> str:
    try:
        import_open3d()
    except InputError as error:
        pytest.skip(str(error))
    path = tmp_path_factory.mktemp("world") / "small.yaml"
    path.write_text(SMALL, "utf-8")
    return str(path)


def test_the_packaged_world_knows_every_place_it_names() -> None:
    world = load_world("world")
    assert world.places.keys() <= LAYOUTS.keys()
    assert {name for name, _ in world.precipitation.kinds} >= {"none", "rain", "snow"}


def test_a_scan_is_of_its_world(small: str) -> None:
    drawn = draw_scan(load_world(small), np.random.default_rng(5))
    assert drawn.place == "street"
    assert drawn.sensor.rows == 16
    assert drawn.precipitation.kind == "snow"
    assert set(np.unique(drawn.scan.label)) <= set(TrackClass)
    assert (drawn.scan.label == TrackClass.RAIN).any()


def test_a_seed_gives_the_same_scans_however_many_there_are(small: str, tmp_path: Path) -> None:
    few = WorldCampaign(train=2, validation=0, seed=3, world=small)
    more = WorldCampaign(train=2, validation=1, test=1, seed=3, world=small)
    simulate_track(tmp_path / "few", few)
    simulate_track(tmp_path / "more", more)
    for name in few.names:
        for file in sorted((tmp_path / "few/sequences" / name).rglob("*.*")):
            other = tmp_path / "more" / file.relative_to(tmp_path / "few")
            assert other.read_bytes() == file.read_bytes()
    first, second = (tmp_path / f"few/sequences/{name}/drawn.yaml" for name in few.names)
    assert first.read_bytes() != second.read_bytes()


def test_another_world_is_not_mixed_in(small: str, tmp_path: Path) -> None:
    simulate_track(tmp_path, WorldCampaign(train=1, validation=0, world=small))
    with pytest.raises(InputError, match="other parameters"):
        simulate_track(tmp_path, WorldCampaign(train=1, validation=0, seed=1, world=small))


@pytest.mark.parametrize(
    ("document", "named"),
    [
        ({"places": {"moon": 1}}, "moon"),
        ({"places": {"street": 0}}, "places: "),
        ({"places": {}}, "places: "),
        ({"places": {"street": -1}}, "places: street: -1.0 "),
        (None, "w.yaml"),
        ({"horizon": 2}, "horizon"),
        ({"weather": "fine"}, "weather"),
        ({"precipitation": {"frogs": {}}}, "frogs"),
        ({"sensors": {"kinds": {"spinning": 0}}}, "kinds"),
    ],
)
def test_a_world_that_cannot_be_is_refused(document: object, named: str) -> None:
    with pytest.raises(InputError) as error:
        World.of(Entry("w.yaml", "", document))
    assert named in str(error.value)
    assert "w.yaml" in str(error.value)


def test_numbers_that_cannot_be_are_refused() -> None:
    for wrong in ({"train": 0}, {"validation": -1}, {"seed": -1}):
        with pytest.raises(InputError):
            WorldCampaign(**wrong)
    with pytest.raises(InputError, match="no such world"):
        WorldCampaign(world="mars").resolved()
