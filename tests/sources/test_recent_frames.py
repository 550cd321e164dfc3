"""Windows of frames as they come in, held against windows cut from the whole recording."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.evaluation.hard_cases import scene
from derain.scan import Scan
from derain.sources.frame import MemoryFrame
from derain.sources.recent_frames import RecentFrames
from derain.sources.window import PlacedScan, Window, WindowOfScans

SCAN = Scan.of(scene(1))


def frames(*lengths: int) -> list[MemoryFrame]:
    """Sequences of so many frames, one after the other, each taken at its place in all of them."""
    pairs = [(name, number) for name, length in enumerate(lengths) for number in range(length)]
    return [
        MemoryFrame(key="", sequence=str(name), number=number, scan=SCAN, time=place)
        for place, (name, number) in enumerate(pairs)
    ]


def seen(scans: WindowOfScans) -> tuple[list[float | None], ...]:
    """Times of the frames before, of the frame, and of those after."""
    parts = (scans.before, [scans.judged], scans.after)
    return tuple([placed.frame.time for placed in part] for part in parts)


@given(
    lengths=st.lists(st.integers(1, 6), min_size=1, max_size=3),
    before=st.integers(0, 3),
    after=st.integers(0, 3),
)
def test_windows_are_those_of_the_whole_recording(lengths, before, after) -> None:
    recent = RecentFrames(Window(before, after))
    found = []
    for frame in frames(*lengths):
        if recent.starts_new_recording(frame):
            found += [recent.pop() for _ in range(recent.waiting)]
        given_back = recent.push(PlacedScan(frame, SCAN))
        found += [given_back] if given_back else []
        assert recent.waiting <= after
    found += [recent.pop() for _ in range(recent.waiting)]

    expected, start = [], 0
    for length in lengths:
        times = [*range(start, start + length)]
        expected += [
            (times[max(place - before, 0) : place], [time], times[place + 1 : place + 1 + after])
            for place, time in enumerate(times)
        ]
        start += length
    assert list(map(seen, found)) == expected


def test_nothing_is_kept_that_no_window_asks_for() -> None:
    recent = RecentFrames(Window(1, 2))
    for frame in frames(50):
        recent.push(PlacedScan(frame, SCAN))
    assert len(recent._kept) == 3  # one given back, two that wait


@pytest.mark.parametrize("number", [0, 3, 5])
def test_a_gap_starts_anew(number) -> None:
    recent = RecentFrames(Window(1, 1))
    all_of_them = frames(10)
    recent.push(PlacedScan(all_of_them[2], SCAN))
    recent.push(PlacedScan(all_of_them[3], SCAN))
    assert recent.starts_new_recording(all_of_them[number])
    assert recent.push(PlacedScan(all_of_them[number], SCAN)) is None
    assert recent.waiting == 1
    assert seen(recent.pop()) == ([], [number], [])
