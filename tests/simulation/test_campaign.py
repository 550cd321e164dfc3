"""What a campaign asks for, and what it refuses."""

import json
from dataclasses import replace
from typing import Any

import pytest

from derain.errors import InputError
from derain.simulation.campaign import FACILITY_RAIN_RATES, Campaign, partition
from derain.simulation.defects import Defects
from derain.simulation.drive import Drive
from derain.simulation.radar import Radar
from derain.simulation.sensor import Sensor
from derain.simulation.sensor_file import load_sensor


def test_the_split_covers_every_sequence_once() -> None:
    split = Campaign().split
    names = [name for part in split.values() for name in part]
    assert list(split) == ["train", "validation", "test"]
    assert [len(part) for part in split.values()] == [16, 4, 8]
    assert names == sorted(set(names)) == Campaign().names
    for part in split.values():
        assert {Campaign().rain_rate[name] for name in part} == set(Campaign().rain_rates)


def test_a_sensor_is_given_by_its_name_or_as_it_is() -> None:
    assert Campaign(sensor="mems_256").lidar == load_sensor("mems_256")
    assert Campaign(sensor=Sensor(rows=7)).lidar == Sensor(rows=7)


def test_the_description_differs_between_campaigns_and_is_json() -> None:
    plain = Campaign().description
    assert json.loads(json.dumps(plain)) == plain
    changes = [
        {"seed": 1},
        {"sensor": "mems_256"},
        {"layout": "facility"},
        {"radar": Radar()},
        {"drive": Drive()},
    ]
    for change in changes:
        assert replace(Campaign(), **change).description != plain
    # A sensor file may change under its name: its content counts.
    assert replace(Campaign(), sensor="mems_64").description == plain


def test_what_few_campaigns_and_sensors_have_is_described_where_one_has_it() -> None:
    assert set(Campaign().description["campaign"]) == {
        *("train", "validation", "test", "scans", "rain_rates", "seed", "sensor", "layout"),
        "radar",
    }
    drive = Campaign(drive=Drive(13, 4)).description["campaign"]["drive"]
    assert drive == {"speed": 13, "traffic": 4, "skew": False}
    usual = Campaign().description["campaign"]["sensor"]
    tilted = Campaign(sensor=Sensor(tilt=(0, 5), defects=Defects(copies=1)))
    described = tilted.description["campaign"]["sensor"]
    assert set(described) - set(usual) == {"tilt", "defects"}
    assert described["tilt"] == [0, 5]
    assert described["defects"]["copies"] == 1


def test_scans_are_taken_at_the_frame_rate_of_the_sensor() -> None:
    assert Campaign(scans=4, sensor=Sensor(frame_rate=20)).times == pytest.approx(
        [0, 0.05, 0.1, 0.15]
    )


@pytest.mark.parametrize("sequences", [1, 2, 3, 4, 5, 10, 25, 143])
def test_sequences_are_parted_as_those_of_rehearse_3d(sequences: int) -> None:
    train, validation, test = partition(sequences)
    assert train + validation + test == sequences
    assert validation == test
    assert (test >= 1) == (sequences >= 3)  # of one or two none is held out
    if sequences == 143:
        assert (train, validation, test) == (85, 29, 29)


def test_two_of_five_sequences_are_clean() -> None:
    assert FACILITY_RAIN_RATES.count(0) / len(FACILITY_RAIN_RATES) == pytest.approx(0.39, abs=0.02)
    assert set(FACILITY_RAIN_RATES) == {0, 10, 25, 50}


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"train": 0}, "train: 0 "),
        ({"validation": -1}, "validation: -1 "),
        ({"scans": 0}, "scans: 0 "),
        ({"scans": 10**9}, "scans: 1000000000 "),
        ({"test": 16**5000}, "test: "),
        ({"seed": -1}, "seed: -1 "),
        ({"rain_rates": ()}, "rain rate: "),
        ({"rain_rates": (-5.0,)}, "rain rate: -5.0 "),
        ({"drive": Drive(13), "layout": "facility"}, "drive: .*facility"),
        ({"drive": Drive(13), "radar": Radar()}, "drive: .*radar"),
        ({"drive": Drive(13), "scans": 2000}, "drive: .*2,599 m"),
        ({"rain_rates": (float("nan"),)}, "rain rate: nan "),
    ],
)
def test_an_impossible_campaign_is_refused(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Campaign(**wrong)
