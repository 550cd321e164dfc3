"""Frames by recordings, and what of a recording does not suit a method of several scans."""

import pytest
from recorded_scenes import write_scenes

from derain.evaluation.hard_cases import scene
from derain.scan import Scan
from derain.sources.folders import named_frames
from derain.sources.frame import Frame, MemoryFrame
from derain.sources.recordings import irregularities, recordings_of, unbroken_recordings
from derain.sources.window import Window

SEVERAL = Window(1, 1)


def frames(*seconds: float | None, sequence: str = "drive") -> list[Frame]:
    scan = Scan.of(scene(10), name="scan")
    return [
        MemoryFrame(key=f"{n}", sequence=sequence, number=n, scan=scan, time=time)
        for n, time in enumerate(seconds)
    ]


def test_a_recording_ends_where_a_frame_does_not_follow() -> None:
    drive, other = frames(0, 1, 2, 3), frames(0, 1, sequence="other")
    found = recordings_of([*drive[:2], drive[3], *other, *drive])
    assert found == [drive[:2], drive[3:], other, drive]
    assert recordings_of([]) == []


@pytest.mark.parametrize(
    ("seconds", "parts"),
    [
        ((0.0, 0.1, 0.2, 0.3), []),
        ((None, None, None), []),
        ((0.0, 0.1, 0.2, 5.0), ["more than 1 s after the scan before it (1 scan in all)"]),
        ((0.0, 0.2, 0.1, 0.0), ["not later than the scan before it (2 scans in all)"]),
        ((0.0, 0.0, 9.0), ["not later", "more than 1 s"]),
        ((0.0,), []),
    ],
)
def test_what_does_not_suit_is_named(seconds, parts) -> None:
    sentences = list(irregularities(frames(*seconds), SEVERAL))
    assert len(sentences) == len(parts)
    for sentence, part in zip(sentences, parts, strict=True):
        assert part in sentence


@pytest.mark.parametrize(
    ("seconds", "lengths"),
    [
        ((0.0, 0.1, 0.2), [3]),
        ((0.0, 0.1, 5.0, 5.1, 5.1, 9.0), [2, 2]),
        ((None, None, None), []),
        ((0.0,), []),
        ((), []),
    ],
)
def test_times_break_a_recording(seconds, lengths) -> None:
    assert [len(part) for part in unbroken_recordings(frames(*seconds))] == lengths


@pytest.mark.parametrize(
    ("names", "lengths"),
    [
        (("000", "002", "004", "014", "100", "102"), [4, 2]),
        (("1700000000000000000", "1700000000100000000", "1700000000200000000"), [3]),
        (("0", "1", "street"), []),
        (("0", "1", "2.5"), []),
    ],
)
def test_names_that_are_numbers_break_a_recording_where_no_times_do(
    tmp_path, names, lengths
) -> None:
    for name in names:
        (tmp_path / f"{name}.bin").touch()
    assert [len(part) for part in unbroken_recordings(named_frames([tmp_path]))] == lengths


def test_names_that_are_numbers_give_the_order_where_no_times_do(tmp_path) -> None:
    paths = sorted(write_scenes(tmp_path, *4 * [10], name="{:03d}.bin").iterdir())
    in_order, backwards = named_frames(paths), named_frames(paths[::-1])
    assert list(irregularities(in_order, SEVERAL)) == []
    assert list(irregularities(backwards, Window())) == []  # asks for one scan
    (sentence,) = irregularities(backwards, SEVERAL)
    assert "002.bin: not later than the scan before it (3 scans in all)" in sentence


@pytest.mark.parametrize(
    ("seconds", "parts"),
    [((0.0, 0.1), []), ((0.0, 9.0, 9.1, 9.2), []), ((0.0, 0.0, 9.0), ["not later"])],
)
def test_a_method_that_can_do_without_other_scans_needs_times_that_rise(seconds, parts) -> None:
    sentences = list(irregularities(frames(*seconds), SEVERAL, needed=False))
    assert len(sentences) == len(parts)
    assert all(part in sentence for part, sentence in zip(parts, sentences, strict=True))


def test_damaged_times_are_named_and_no_more(tmp_path) -> None:
    write_scenes(tmp_path, 10, 10, 10, name="{}.bin")
    (tmp_path / "times.txt").write_text("soon\n")
    for needed in (False, True):
        (sentence,) = irregularities(named_frames([tmp_path]), SEVERAL, needed=needed)
        assert "0.bin: " in sentence
        assert "line 1 is not 1 number" in sentence
