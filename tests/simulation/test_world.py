"""The training world: drawn by its spans, the same by its seed, refused where impossible."""

from dataclasses import replace

import numpy as np
import pytest

from derain.errors import InputError
from derain.files.documents import Entry
from derain.simulation.classes import TrackClass
from derain.simulation.dataset import simulate_track
from derain.simulation.layouts import LAYOUTS
from derain.simulation.world import World, WorldCampaign, draw_scan, load_world, packaged_worlds


@pytest.mark.parametrize("name", packaged_worlds())
def test_a_packaged_world_draws_from_places_and_kinds_that_there_are(name) -> None:
    world = load_world(name)
    assert world.places.keys() == LAYOUTS.keys()
    assert world.precipitation.keys() >= {"none", "rain"}


def test_a_scan_is_of_its_world(small_world) -> None:
    scan, drawn = draw_scan(load_world(small_world), np.random.default_rng(5))
    assert drawn["place"] == "street"
    assert drawn["sensor"]["rows"] == 32
    assert drawn["precipitation"]["kind"] == "snow"
    assert set(np.unique(scan.label)) <= set(TrackClass)
    assert (scan.label == TrackClass.RAIN).any()


def test_a_world_of_nothing_but_rain_is_refused(small_world, monkeypatch) -> None:
    monkeypatch.setattr("derain.simulation.world.LARGEST_SHARE_OF_RAIN", -1)
    monkeypatch.setattr("derain.simulation.world.MOST_TRIES", 2)
    with pytest.raises(InputError, match=r"world: .*rain"):
        draw_scan(load_world(small_world), np.random.default_rng(5))


def test_a_seed_gives_the_same_scans_however_many_there_are(small_world, tmp_path) -> None:
    few = WorldCampaign(train=2, validation=0, seed=3, world=str(small_world))
    more = WorldCampaign(train=2, validation=1, test=1, seed=3, world=str(small_world))
    simulate_track(tmp_path / "few", few)
    simulate_track(tmp_path / "more", more)
    for name in few.names:
        for file in sorted((tmp_path / "few/sequences" / name).rglob("*.*")):
            other = tmp_path / "more" / file.relative_to(tmp_path / "few")
            assert other.read_bytes() == file.read_bytes()
    with pytest.raises(InputError, match="other parameters"):
        simulate_track(tmp_path / "few", replace(few, seed=4))
    first, second = (tmp_path / f"few/sequences/{name}/drawn.yaml" for name in few.names)
    assert first.read_bytes() != second.read_bytes()


@pytest.mark.parametrize(
    ("document", "named"),
    [
        ({"places": {"moon": 1}}, "moon"),
        ({"places": {"street": -1}}, "places: "),
        (None, "empty"),
        ({"horizon": 2}, "horizon"),
        ({"precipitation": {"frogs": {}}}, "frogs"),
        ({"precipitation": {"snow": {"weight": 0}}}, "precipitation: "),
        ({"precipitation": {}}, "precipitation: "),
    ],
)
def test_a_world_that_cannot_be_is_refused(document, named) -> None:
    with pytest.raises(InputError, match=rf"w\.yaml: .*{named}"):
        World.of(Entry("w.yaml", "", document))


def test_a_world_that_is_not_there_is_refused() -> None:
    with pytest.raises(InputError, match="no such world"):
        WorldCampaign(world="mars").resolved()
