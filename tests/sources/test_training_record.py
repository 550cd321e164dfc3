"""What a network was trained on is recorded, and known again where it is measured."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.cards.card import load_card
from derain.export.model_file import ModelFile
from derain.sources.folders import named_frames
from derain.sources.source import Source
from derain.sources.spread import evenly_spaced
from derain.sources.training_record import (
    MOST_NAMES,
    record_of_scans,
    record_of_sequences,
    training_overlap,
)

CARD = load_card("wads")
SPEC = ModelFile.read(Path(__file__).parents[1] / "export/kept/outdet.onnx").spec


@pytest.fixture
def scans(tmp_path) -> Source:
    """Two scans of a sequence and one of another, each of its own content."""
    paths = [tmp_path / f"sequences/{name}.bin" for name in ("11/v/a", "11/v/b", "12/v/a")]
    for number, path in enumerate(paths):
        path.parent.mkdir(parents=True, exist_ok=True)
        np.full(4 * 10, number, "<f4").tofile(path)
    return named_frames(paths)


def test_a_sequence_is_known_by_its_name_where_the_data_are_the_same(scans) -> None:
    spec = replace(SPEC, training=record_of_sequences(["10", "11"]))
    note = training_overlap("mine", spec, CARD, scans)
    assert note.startswith(f"mine was trained on 2 of these 3 scans, such as {scans[0].name}")
    others = replace(spec, training=record_of_sequences(["10", "13"]))
    assert training_overlap("mine", others, CARD, scans) is None
    # Sequences of other data may well be called the same.
    assert training_overlap("mine", replace(spec, data="other data"), CARD, scans) is None


def test_a_scan_is_known_by_its_content_wherever_it_lies(scans, tmp_path) -> None:
    spec = replace(SPEC, training=record_of_scans(scans[:1]), data="whatever")
    moved = tmp_path / "elsewhere" / "other_name.bin"
    moved.parent.mkdir()
    moved.write_bytes(Path(scans[0].name).read_bytes())
    note = training_overlap("mine", spec, CARD, [scans[1], *named_frames([moved])])
    assert note.startswith(f"mine was trained on 1 of these 2 scans, such as {moved}")
    # One of the same name in a folder of the same name is another.
    assert training_overlap("mine", spec, CARD, scans[1:]) is None


def test_nothing_is_reported_where_nothing_is_known(scans) -> None:
    assert record_of_scans([]) == record_of_sequences([]) == {}
    assert training_overlap("mine", replace(SPEC, training={}), CARD, scans) is None


def test_a_record_stays_small(scans, monkeypatch) -> None:
    assert len(record_of_sequences(map(str, range(2 * MOST_NAMES)))["sequences"]) == MOST_NAMES
    monkeypatch.setattr("derain.sources.training_record.MOST_NAMES", 2)
    assert record_of_scans(scans) == {
        "scans": tuple(sorted(frame.fingerprint() for frame in scans[::2]))
    }


@given(st.integers(0, 60), st.integers(1, 20))
def test_items_are_spread_evenly_from_first_to_last(count, most) -> None:
    items = list(range(count))
    spaced = evenly_spaced(items, most)
    assert len(spaced) == min(count, most)
    steps = np.diff(spaced)
    assert (steps > 0).all()
    assert not len(steps) or steps.max() - steps.min() <= 1
    if count and most > 1:
        assert (spaced[0], spaced[-1]) == (0, count - 1)
