"""What a network was trained on is recorded by name, and known again where it is measured."""

from dataclasses import replace
from pathlib import Path

import pytest

from derain.cards import load_card
from derain.export.model_file import ModelFile
from derain.training_record import MOST_NAMES, overlap, recorded, whole

CARD = load_card("wads")
SPEC = ModelFile.read(Path(__file__).parent / "export/kept/outdet.onnx").spec


def scan(sequence: str, stem: str) -> Path:
    return Path("data/sequences") / sequence / "velodyne" / f"{stem}.bin"


def test_scans_are_recorded_by_their_sequence() -> None:
    scans = [scan("11", "b"), scan("11", "a"), scan("10", "a"), scan("11", "a")]
    assert recorded(scans) == {"10": ("a",), "11": ("a", "b")}
    assert recorded([]) == {}


def test_a_record_stays_small() -> None:
    many = [scan(f"{number % 3}", str(number)) for number in range(MOST_NAMES + 1)]
    assert recorded(many) == {"0": (), "1": (), "2": ()}
    assert sum(map(len, recorded(many[:-1]).values())) == MOST_NAMES
    everywhere = [scan(str(number), "a") for number in range(2 * MOST_NAMES)]
    assert len(recorded(everywhere)) == MOST_NAMES
    assert len(whole(map(str, range(2 * MOST_NAMES)))) == MOST_NAMES


@pytest.mark.parametrize(
    ("training", "known"),
    [
        ({}, 0),
        ({"11": ("a", "c"), "12": ("d",)}, 1),
        ({"11": ("a", "b"), "12": ("c",)}, 3),
        ({"11": ()}, 2),
        (whole(["10", "13"]), 0),
    ],
)
def test_what_a_model_is_measured_on_is_known_by_its_names(
    training: dict[str, tuple[str, ...]], known: int
) -> None:
    scans = [scan("11", "a"), scan("11", "b"), scan("12", "c")]
    note = overlap("mine", replace(SPEC, training=training), CARD, scans)
    if known:
        assert note is not None
        assert note.startswith(f"mine was trained on {known} of these 3 scans, such as data/seq")
    else:
        assert note is None
    # Sequences of other data may well be called the same.
    other = replace(SPEC, training=training, data="other data")
    assert overlap("mine", other, CARD, scans) is None
