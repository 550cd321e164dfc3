"""Scans in memory, and any source, are data like files."""

import numpy as np
import pytest

from derain.cards.card import load_card
from derain.datamodules.base import Loading
from derain.datamodules.in_memory import InMemory
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.scan import Scan
from derain.sources.folders import named_frames
from derain.sources.source import Frames

WADS = load_card("wads")


def labelled(number: int) -> Scan:
    return Scan.of(scene(40, seed=number)).with_label(np.resize((0, 110), 40))


def test_scans_are_read_as_they_are_given_but_in_the_unit_of_the_card() -> None:
    loading = Loading(intensity_scale=2.0)
    data = InMemory([labelled(0), labelled(1)], test=labelled(2), card=WADS, loading=loading)
    frames = data.frames("train")
    assert [frame.key for frame in frames] == ["000000", "000001"]
    for number, frame in enumerate(frames):
        scan, points = data.reader.read(frame), scene(40, seed=number)
        np.testing.assert_array_equal(scan.xyz, points[:, :3])
        np.testing.assert_array_equal(scan.intensity, 2 * points[:, 3])
        np.testing.assert_array_equal(scan.label, labelled(number).label)
    (frame,) = data.frames("predict")
    assert data.reader.read(frame).label is None
    assert data.card is WADS


def test_a_source_is_taken_as_it_is(tmp_path) -> None:
    scene(40).tofile(tmp_path / "a.bin")
    files = named_frames([tmp_path])
    data = InMemory(test=files, card="wads")
    assert data.source("test") is files
    assert [frame.key for frame in data.frames("predict")] == ["a"]
    memory = Frames.of_scans([labelled(0)], "drive")
    assert InMemory(test=memory, card="wads").frames("test")[0].sequence == "drive"


def test_what_cannot_be_used_is_refused() -> None:
    data = InMemory(test=[Scan.of(scene(40))], card="wads")
    with pytest.raises(InputError, match="no labels"):
        data.frames("test")
    with pytest.raises(InputError, match=r"validation: there are no scans for it\. Give scans"):
        data.frames("validation")
