"""Scans in memory, and any source, are data like files."""

from pathlib import Path

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


def labelled(number: int, ids: tuple[int, ...] = (0, 110)) -> Scan:
    return Scan.of(scene(40, seed=number)).with_label(np.resize(ids, 40))


def test_scans_are_read_as_they_are_given() -> None:
    data = InMemory([labelled(0), labelled(1)], test=[labelled(2)], card=WADS)
    frames = data.frames("train")
    assert [frame.key for frame in frames] == ["000000", "000001"]
    for number, frame in enumerate(frames):
        scan = data.read(frame)
        np.testing.assert_array_equal(np.c_[scan.xyz, scan.intensity], scene(40, seed=number))
        np.testing.assert_array_equal(scan.label, labelled(number).label)
    (frame,) = data.frames("predict")
    assert data.read(frame).label is None
    assert data.card is WADS


def test_one_scan_is_taken_and_what_is_no_scan_is_refused() -> None:
    data = InMemory(labelled(0), card=WADS)
    assert len(data.frames("train")) == 1
    with pytest.raises(InputError, match=r"scan\.bin: .*derain\.read_scan"):
        InMemory(["scan.bin"], card=WADS)


def test_intensities_are_taken_to_the_unit_of_the_card() -> None:
    data = InMemory([labelled(0)], card="wads", loading=Loading(intensity_scale=2.0))
    scan = data.read(data.frames("train")[0])
    np.testing.assert_array_equal(scan.intensity, 2 * scene(40)[:, 3])


def test_points_at_one_position_are_measured_once_where_the_card_says_so() -> None:
    twice = Scan.of(np.repeat(scene(20), 2, axis=0)).with_label(np.zeros(40, np.int64))
    for card, points in (("wads", 20), ("kitti", 40)):
        data = InMemory(test=[twice], card=card)
        frame = data.frames("test")[0]
        assert (len(data.read(frame)), len(data.read_measured(frame))) == (40, points)


def test_a_source_is_taken_as_it_is(tmp_path: Path) -> None:
    scene(40).tofile(tmp_path / "a.bin")
    files = named_frames([tmp_path])
    data = InMemory(test=files, card="wads")
    assert data.source("test") is files
    assert [frame.key for frame in data.frames("predict")] == ["a"]
    with pytest.raises(InputError, match=r"a\.bin: .*no labels"):
        data.frames("test")
    memory = Frames.of_scans([labelled(0)], "drive")
    assert InMemory(test=memory, card="wads").frames("test")[0].sequence == "drive"


def test_what_cannot_be_used_is_said() -> None:
    data = InMemory([labelled(0, (0, 777))], test=[Scan.of(scene(40))], card="wads")
    with pytest.raises(InputError, match=r"ids \[777\] are no classes of WADS"):
        data.read(data.frames("train")[0])
    with pytest.raises(InputError, match="no labels"):
        data.frames("test")
    with pytest.raises(InputError, match=r"validation: there are no scans for it\. Give scans"):
        data.frames("validation")
    with pytest.raises(InputError, match="winter: no such data card"):
        InMemory(card="winter")
