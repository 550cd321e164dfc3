"""What a campaign describes, and what it refuses."""

import json
import math
from dataclasses import replace

import pytest

from derain.errors import InputError
from derain.simulation.campaign import Campaign, Drive, partition
from derain.simulation.radar import Radar


def test_the_split_covers_every_sequence_once() -> None:
    split = Campaign().split
    names = [name for part in split.values() for name in part]
    assert list(split) == ["train", "validation", "test"]
    assert [len(part) for part in split.values()] == [16, 4, 8]
    assert names == sorted(set(names)) == Campaign().names
    for part in split.values():
        assert {Campaign().rain_rate[name] for name in part} == set(Campaign().rain_rates)


def test_the_description_differs_between_campaigns_and_is_json() -> None:
    plain = Campaign().description
    assert json.loads(json.dumps(plain)) == plain
    for change in ({"seed": 1}, {"sensor": "mems_256"}, {"radar": Radar()}, {"drive": Drive()}):
        assert replace(Campaign(), **change).description != plain
    # A sensor file may change under its name: its content counts.
    assert replace(Campaign(), sensor="mems_64").description == plain


def test_sequences_are_parted_as_those_of_rehearse_3d() -> None:
    assert partition(143) == (85, 29, 29)
    for sequences in range(1, 200):
        train, validation, test = partition(sequences)
        assert train + validation + test == sequences
        assert validation == test
        assert (test >= 1) == (sequences >= 3)  # of one or two none is held out


@pytest.mark.parametrize(
    ("make", "wrong", "message"),
    [
        (Campaign, {"train": 0}, "train: 0 "),
        (Campaign, {"validation": -1}, "validation: -1 "),
        (Campaign, {"scans": 10**9}, "scans: 1000000000 "),
        (Campaign, {"test": 16**5000}, "test: "),
        (Campaign, {"seed": -1}, "seed: -1 "),
        (Campaign, {"rain_rates": ()}, r"rain_rates: \(\) "),
        (Campaign, {"rain_rates": (math.nan,)}, "rain: .*nan "),
        (Campaign, {"layout": "moon"}, "layout: 'moon' .*street"),
        (Campaign, {"drive": Drive(13), "layout": "facility"}, "drive: .*street"),
        (Campaign, {"drive": Drive(13), "radar": Radar()}, "drive: .*radar"),
        (Campaign, {"drive": Drive(13), "scans": 2000}, "drive: .*2,000"),
        (Drive, {"speed": -1.0}, "speed: -1.0 "),
        (Drive, {"speed": math.nan}, "speed: nan "),
        (Drive, {"traffic": -1}, "traffic: -1 "),
        (Drive, {"traffic": 10**9}, "traffic: 1000000000 "),
    ],
)
def test_an_impossible_campaign_or_drive_is_refused(make, wrong, message) -> None:
    with pytest.raises(InputError, match=message):
        make(**wrong)
