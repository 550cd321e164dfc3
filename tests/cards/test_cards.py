"""Data cards: the packaged ones say what was published, and a user's own are read with care."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from derain.cards.card import DataCard, load_card, packaged_cards
from derain.errors import InputError
from derain.files.documents import shown
from derain.learning.losses import class_weights
from derain.scan import Scan

OWN: dict[str, Any] = {
    "name": "our yard",
    "classes": {0: "ground", 3: "rain", 4: "spray"},
    "rain": [3, 4],
    "mean": [1, 2, 3, 4],
    "std": [5.0, 6.0, 7.0, 8.0],
    "range": [9, 10],
    "extra": {"doppler": [-0.5, 2], "ring": [31.5, 18.4]},
    "rain_share": 0.25,
    "split": {"train": ["00", "010"], "test": ["008"]},
}


@pytest.fixture
def card_file(tmp_path: Path) -> Path:
    return tmp_path / "yard.yaml"


@pytest.mark.parametrize("name", packaged_cards())
def test_a_packaged_card_can_be_read(name: str) -> None:
    card = load_card(name)
    assert set(card.rain) <= set(card.classes)
    assert len(set(card.classes.values())) == len(card.classes)
    assert card.std is None or min(card.std) > 0


# Source: sporsho/3D_OutDet, class weights that its recipes were trained with.
@pytest.mark.parametrize(
    ("name", "weights", "rain"),
    [
        ("wads", (1.135, 8.282), (110,)),
        ("kitti", (1.110, 9.901), (1,)),
        ("spray", (1.011, 76.1), (2,)),
        ("rehearse3d", (1.070, 14.840), (3,)),
    ],
)
def test_the_rain_share_gives_the_published_class_weights(
    name: str, weights: tuple[float, float], rain: tuple[int, ...]
) -> None:
    card = load_card(name)
    assert card.rain_share is not None
    assert class_weights([1 - card.rain_share, card.rain_share]).tolist() == pytest.approx(
        weights, rel=1e-3
    )
    assert card.rain == rain


def test_a_split_is_of_different_sequences() -> None:
    for name in packaged_cards():
        parts = load_card(name).split.values()
        sequences = [sequence for part in parts for sequence in part]
        assert len(set(sequences)) == len(sequences)


def test_a_card_of_ones_own_holds_what_its_file_says(card_file: Path) -> None:
    card_file.write_text(yaml.safe_dump(OWN))
    assert load_card(card_file) == DataCard(
        name="our yard",
        classes={0: "ground", 3: "rain", 4: "spray"},
        rain=(3, 4),
        mean=(1.0, 2.0, 3.0, 4.0),
        std=(5.0, 6.0, 7.0, 8.0),
        range=(9.0, 10.0),
        extra={"doppler": (-0.5, 2.0), "ring": (31.5, 18.4)},
        rain_share=0.25,
        split={"train": ("00", "010"), "test": ("008",)},
    )


def test_a_card_of_an_earlier_version_keeps_its_automatic_detection(card_file: Path) -> None:
    card_file.write_text(yaml.safe_dump({**OWN, "folders_tell": "rain"}))
    assert load_card(card_file).auto_detect == "rain"


def test_a_card_without_all_its_statistics_says_so(card_file: Path) -> None:
    for missing in ("mean", "std", "range", "rain_share"):
        card_file.write_text(yaml.safe_dump({k: v for k, v in OWN.items() if k != missing}))
        card = load_card(card_file)
        assert not card.has_statistics
        statistics = {"mean": (0.0,) * 4, "std": (1.0,) * 4, "range": (9.0, 9.0), "rain_share": 0.5}
        whole = card.completed(**statistics)
        assert whole.has_statistics
        # What it knew already stays.
        assert whole == card.completed(**{missing: statistics[missing]})


def test_every_channel_has_its_statistics_and_its_unit(card_file: Path) -> None:
    card_file.write_text(yaml.safe_dump(OWN))
    card = load_card(card_file)
    assert card.statistics("intensity") == (4, 8)
    assert card.statistics("range") == (9, 10)
    assert card.statistics("doppler") == (-0.5, 2)
    units = {name: card.unit(name) for name in ("z", "range", "doppler", "rcs", "radar", "ring")}
    assert units == {
        "z": "m",
        "range": "m",
        "doppler": "m/s",
        "rcs": "dBsm",
        "radar": "0 or 1",
        "ring": "not stated",
    }
    with pytest.raises(InputError, match="our yard: the data card has no statistics of rcs"):
        card.statistics("rcs")


def test_extra_statistics_join_those_that_a_card_has(card_file: Path) -> None:
    card_file.write_text(yaml.safe_dump(OWN))
    card = load_card(card_file).completed(extra={"rcs": (1.0, 2.0), "ring": (0.0, 1.0)})
    assert card.extra == {"doppler": (-0.5, 2), "ring": (31.5, 18.4), "rcs": (1, 2)}


@pytest.mark.parametrize(
    "change",
    [
        {"classes": None},
        {"classes": ["ground", "rain"]},
        {"classes": {"three": "rain"}},
        {"classes": {0: "ground", 3: "rain", 4: "spray", 10**6: "moon"}},
        {"classes": {0: "ground", 3: ["rain"], 4: "spray"}},
        {"name": {"a": 1}},
        {"classes": {0: "rain", 3: "rain", 4: "spray"}},
        {"rain": 3},
        {"rain": [5]},
        {"unknown": [5]},
        {"simulated": "no"},
        {"unknown": [0, 3]},
        {"unknown": 4},
        {"rain": [3, math.inf]},
        {"rain": [[3]]},
        {"rain": [10**400]},
        {"mean": [1, 2, 3]},
        {"mean": 1},
        {"mean": [1, 2, 3, 10**400]},
        {"mean": list(range(5000))},
        {"std": [1, 1, 1, 0]},
        {"mean": [1, 2, 3, math.nan]},
        {"std": [1, 1, 1, math.inf]},
        {"std": ["a", "b", "c", "d"]},
        {"extra": ["doppler"]},
        {"extra": {"doppler": [1]}},
        {"extra": {"doppler": None}},
        {"extra": {"doppler": [1, 0]}},
        {"rain_share": 1.5},
        {"rain_share": "much"},
        {"split": {"train": "00"}},
        {"split": ["00"]},
        {"split": {"train": [["00"]]}},
        {"licence": ["free"] * 1000},
        {"resolution": 5},
    ],
    ids=shown,
)
def test_a_card_that_makes_no_sense_is_refused(card_file: Path, change: dict[str, Any]) -> None:
    card_file.write_text(yaml.safe_dump({**OWN, **change}))
    (key,) = change
    with pytest.raises(InputError, match=rf"yard\.yaml: {key}.*: ") as refusal:
        load_card(card_file)
    assert len(str(refusal.value)) < len(str(card_file)) + 300


def test_a_sequence_that_yaml_reads_as_a_number_is_refused(card_file: Path) -> None:
    text = yaml.safe_dump({**OWN, "split": {}}).replace("split: {}", "split: {train: [010]}")
    card_file.write_text(text)
    with pytest.raises(InputError, match=r"split\.train\[0\]: 8 is no text\. Put it in quotes"):
        load_card(card_file)


@pytest.mark.parametrize("text", ["", "name only", "a: [1", "name: x", "\x00"], ids=repr)
def test_a_file_that_is_no_card_is_refused_in_one_line(card_file: Path, text: str) -> None:
    card_file.write_text(text)
    with pytest.raises(InputError, match=r"yard\.yaml: .") as refusal:
        load_card(card_file)
    assert "\n" not in str(refusal.value)


def test_a_file_that_is_not_text_is_refused(card_file: Path) -> None:
    card_file.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(InputError, match=r"yard\.yaml: cannot be read"):
        load_card(card_file)


def test_rain_is_every_class_that_the_card_says(card_file: Path) -> None:
    card_file.write_text(yaml.safe_dump(OWN))
    scan = Scan.of(np.ones((4, 4)), name="a.bin")
    rain = load_card(card_file).rain_of(scan.with_label(np.array([0, 3, 4, 3])))
    assert rain.tolist() == [False, True, True, True]
    with pytest.raises(InputError, match=r"a\.bin: it has no labels"):
        load_card(card_file).rain_of(scan)


def test_an_unknown_class_is_neither_rain_nor_not(card_file: Path) -> None:
    card_file.write_text(yaml.safe_dump({**OWN, "rain": [3], "unknown": [4]}))
    card = load_card(card_file)
    scan = Scan.of(np.ones((3, 4)), name="a.bin").with_label(np.array([0, 3, 4]))
    assert card.rain_of(scan).tolist() == [False, True, False]
    assert card.unknown_of(scan).tolist() == [False, False, True]
    assert not replace(card, unknown=()).unknown_of(scan).any()


def test_an_unknown_name_is_answered_with_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"rehearse: no such data card\. .*rehearse3d.*wads"):
        load_card("rehearse")


def test_the_class_shares_of_a_card_are_of_all_points() -> None:
    # data_cfg.yaml of the published SalsaNext run: rain has 0.0664 of the points.
    share = load_card("rehearse3d").rain_share
    assert share is not None
    assert math.isclose(share, 0.06638644365199696, rel_tol=1e-6)


def test_a_card_of_clean_data_says_that_it_has_no_rain(card_file: Path) -> None:
    card_file.write_text(yaml.safe_dump({**OWN, "rain": []}))
    card = load_card(card_file)
    scan = Scan.of(np.ones((2, 4))).with_label(np.array([0, 3]))
    assert card.rain == ()
    assert not card.rain_of(scan).any()
    card_file.write_text(yaml.safe_dump({k: v for k, v in OWN.items() if k != "rain"}))
    with pytest.raises(InputError, match="rain is missing"):
        load_card(card_file)


def test_semantickitti_has_the_classes_of_wads_but_for_its_snow() -> None:
    clean, wads = load_card("semantickitti"), load_card("wads")
    assert clean.rain == ()
    assert clean.classes == {id_: n for id_, n in wads.classes.items() if "snow" not in n}
    sequences = [name for names in clean.split.values() for name in names]
    assert sorted(sequences) == [f"{number:02d}" for number in range(22)]
    assert clean.split["validation"] == ("08",)


def test_a_card_takes_the_normalisation_of_another_and_stays_itself() -> None:
    rehearse, wads = load_card("rehearse3d"), load_card("wads")
    both = rehearse.normalised_as(wads)
    for channel in ("x", "y", "z", "intensity", "range"):
        assert both.statistics(channel) == wads.statistics(channel)
    assert replace(both, mean=None, std=None, range=None) == rehearse


def test_known_points_are_those_that_are_rain_or_not() -> None:
    card = DataCard("ours", {0: "ground", 3: "rain", 9: "haze"}, rain=(3,), unknown=(9,))
    scan = Scan(np.arange(12, dtype=np.float32).reshape(4, 3)).with_label(np.array([3, 9, 0, 9]))
    known, rain = card.known_points(scan)
    np.testing.assert_array_equal(known.xyz, scan.xyz[[0, 2]])
    assert rain.tolist() == [True, False]
