"""Data cards: the packaged ones hold what was published, and a user's own are read with care."""

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
def card_file(tmp_path) -> Path:
    return tmp_path / "yard.yaml"


def written(card_file: Path, *missing: str, **changes: Any) -> DataCard:
    """Our own card as read from a file, with changes and without some of its keys."""
    content = {name: value for name, value in {**OWN, **changes}.items() if name not in missing}
    card_file.write_text(yaml.safe_dump(content))
    return load_card(card_file)


@pytest.mark.parametrize("name", packaged_cards())
def test_a_packaged_card_can_be_read(name) -> None:
    card = load_card(name)
    assert set(card.rain) <= set(card.classes)
    assert all(std > 0 for _, std in card.moments.values())
    sequences = [sequence for part in card.split.values() for sequence in part]
    assert len(set(sequences)) == len(sequences)


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
def test_the_rain_share_gives_the_published_class_weights(name, weights, rain) -> None:
    card = load_card(name)
    assert class_weights([1 - card.rain_share, card.rain_share]).tolist() == pytest.approx(
        weights, rel=1e-3
    )
    assert card.rain == rain
    if name == "rehearse3d":  # data_cfg.yaml of its published SalsaNext run, of all points
        assert card.rain_share == pytest.approx(0.06638644365199696)


def test_a_card_of_ones_own_holds_what_is_in_its_file(card_file) -> None:
    assert written(card_file) == DataCard(
        name="our yard",
        classes={0: "ground", 3: "rain", 4: "spray"},
        rain=(3, 4),
        moments={
            **{"x": (1.0, 5.0), "y": (2.0, 6.0), "z": (3.0, 7.0), "intensity": (4.0, 8.0)},
            **{"range": (9.0, 10.0), "doppler": (-0.5, 2.0), "ring": (31.5, 18.4)},
        },
        rain_share=0.25,
        split={"train": ("00", "010"), "test": ("008",)},
    )


def test_a_card_of_an_earlier_version_keeps_its_automatic_detection(card_file) -> None:
    assert written(card_file, folders_tell="rain").auto_detect == "rain"


@pytest.mark.parametrize("missing", ["mean", "std", "range", "rain_share"])
def test_a_card_is_completed_by_the_statistics_that_it_lacks(card_file, missing) -> None:
    card = written(card_file, missing)
    assert not card.has_statistics
    measured = dict.fromkeys(("x", "y", "z", "intensity", "range", "rcs", "ring"), (0.0, 1.0))
    whole = card.completed(measured, 0.5)
    assert whole.has_statistics
    # What it knew already stays.
    assert whole.moments == {**measured, **card.moments}
    assert whole.rain_share == (0.5 if missing == "rain_share" else 0.25)


def test_every_channel_has_its_statistics_and_its_unit(card_file) -> None:
    card = written(card_file)
    assert card.statistics("intensity") == (4, 8)
    assert card.statistics("range") == (9, 10)
    assert card.statistics("doppler") == (-0.5, 2)
    units = {"z": "m", "range": "m", "doppler": "m/s", "rcs": "dBsm", "radar": "0 or 1"}
    assert {name: card.unit(name) for name in (*units, "ring")} == {**units, "ring": "not stated"}
    with pytest.raises(InputError, match="our yard: the data card has no statistics of rcs"):
        card.statistics("rcs")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("classes", {"three": "rain"}),
        ("classes", {0: "ground", 3: "rain", 4: "spray", 10**6: "moon"}),
        ("classes", {0: "rain", 3: "rain", 4: "spray"}),
        *(("rain", value) for value in (3, [5], [3, np.inf])),
        *(("unknown", value) for value in ([5], [0, 3])),
        *(("mean", [1, 2, 3]), ("std", [1, 1, 1, 0]), ("extra", {"doppler": [1, 0]})),
        *(("rain_share", 1.5), ("split", {"train": [8]})),  # as YAML reads 010
        ("split", {"trian": ["00"]}),
        *(("licence", ["free"] * 1000), ("simulated", "no"), ("auto_detect", "all")),
        ("resolution", 5),
    ],
    ids=shown,
)
def test_a_card_that_makes_no_sense_is_refused(card_file, key, value) -> None:
    with pytest.raises(InputError, match=rf"yard\.yaml: {key}.*: ") as refusal:
        written(card_file, **{key: value})
    assert len(str(refusal.value)) < len(str(card_file)) + 300


@pytest.mark.parametrize(
    ("classes", "ids", "named"),
    [
        ({0: "a", 1: "a"}, {"rain": (0,)}, "classes"),
        ({0: "a"}, {"rain": (5,)}, "rain"),
        ({0: "a"}, {"rain": (0,), "unknown": (0,)}, "unknown"),
        ({0: "a"}, {"rain": (0,), "split": {"trian": ("00",)}}, r"split\.trian"),
    ],
)
def test_a_card_made_in_python_is_checked_too(classes, ids, named) -> None:
    with pytest.raises(InputError, match=f"^{named}: "):
        DataCard("odd", classes, **ids)


def test_an_unknown_name_is_answered_with_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"rehearse: no such data card\. .*rehearse3d.*wads"):
        load_card("rehearse")


def test_classes_are_rain_unknown_or_neither(card_file) -> None:
    scan = Scan.of(np.arange(16.0).reshape(4, 4), name="a.bin")
    card = written(card_file, rain=[3], unknown=[4])
    labelled = scan.with_label(np.array([0, 3, 4, 3]))
    assert written(card_file).rain_of(labelled).tolist() == [False, True, True, True]
    assert card.rain_of(labelled).tolist() == [False, True, False, True]
    assert card.unknown_of(labelled).tolist() == [False, False, True, False]
    known, rain = card.known_points(labelled)
    np.testing.assert_array_equal(known.xyz, scan.xyz[[0, 1, 3]])
    assert rain.tolist() == [False, True, True]
    assert not replace(card, unknown=()).unknown_of(labelled).any()
    assert not written(card_file, rain=[]).rain_of(labelled).any()
    with pytest.raises(InputError, match=r"a\.bin: it has no labels"):
        card.rain_of(scan)
    with pytest.raises(InputError, match="rain is missing"):
        written(card_file, "rain")


def test_a_card_takes_the_normalisation_of_another_and_stays_itself() -> None:
    rehearse, wads = load_card("rehearse3d"), load_card("wads")
    both = rehearse.normalised_as(wads)
    for channel in ("x", "y", "z", "intensity", "range"):
        assert both.statistics(channel) == wads.statistics(channel)
    assert replace(both, moments={}) == rehearse
