"""Sources in units: the union of units gives what one run gives, byte for byte."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from contents import contents
from hypothesis import given
from hypothesis import strategies as st
from recorded_scenes import write_drive
from small_bags import small_bag
from window_method import Between

import derain
from derain.evaluation.hard_cases import scene
from derain.export.recorded import RecordedDerainer
from derain.jobs.shard import Shard
from derain.jobs.workers import WorkerPool
from derain.sources.clean_sink import CleanSink, Destination
from derain.sources.cleaned_scan import ScanOutcome
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.recent_frames import ScanError
from derain.sources.source import Source
from derain.sources.unit_cleaning import UnitCleaning
from derain.sources.units import Division, units_of
from derain.sources.weather_monitor import WeatherOptions
from derain.sources.window import Window, WindowOfScans

SCANS = 7

clean = partial(derain.clean, most_removed=1)


@pytest.fixture
def drive(tmp_path) -> Path:
    """Two recordings with poses, in which scan 3 of the first cannot be read."""
    for place, name in enumerate(("first", "second")):
        write_drive(tmp_path / "drives/sequences" / name / "velodyne", SCANS, 400, seed=7 * place)
    (tmp_path / "drives/sequences/first/velodyne/000003.bin").write_bytes(b"broken")
    return tmp_path / "drives"


METHODS = {
    "a filter": lambda: derain.FilterDerainer(derain.DROR()),
    "persistence": lambda: derain.PersistenceDerainer(),
    "a model over recordings": lambda: RecordedDerainer(derain.Derainer(), past=2, delay=1),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("block", [1, 2, 50])
def test_the_union_of_units_is_what_one_run_gives(drive, tmp_path, method, block) -> None:
    source, every = derain.named_frames(drive), WeatherOptions(every_scan=True)
    reports = [
        clean(source, METHODS[method](), tmp_path / name, weather=every, division=division)
        for name, division in (("whole", None), ("units", Division(block, keep_records=True)))
    ]
    assert contents(tmp_path / "whole") == contents(tmp_path / "units")
    assert len(contents(tmp_path / "whole")) == 2 * (2 * SCANS - 1)
    whole, units = ([scan.weather for scan in report.scans] for report in reports)
    assert whole == units
    assert [report.not_cleaned for report in reports] == [1, 1]


def test_shares_and_workers_give_the_same_and_a_last_run_finds_everything_done(
    drive, tmp_path
) -> None:
    method = derain.FilterDerainer(derain.DROR(), threads=1)
    (drive / "sequences/first/velodyne/000003.bin").unlink()
    source = derain.named_frames(drive)
    clean(source, method, tmp_path / "whole")
    for number in range(3):
        clean(source, method, tmp_path / "shares", division=Division(2, Shard(number, 3)))
    with WorkerPool(2) as pool:
        clean(source, method, tmp_path / "workers", division=Division(2), executor=pool)
    assert contents(tmp_path / "whole") == contents(tmp_path / "shares")
    assert contents(tmp_path / "whole") == contents(tmp_path / "workers")
    report = clean(source, method, tmp_path / "shares", division=Division(2))
    assert report.before == len(report.scans) == 2 * SCANS - 1


class Failing(Between):
    """Sees some scans before and after, and fails at some by an error that does not name them."""

    window = Window()

    def __init__(self, window: Window, bad: frozenset[int]) -> None:
        self.window, self.bad = window, bad
        super().__init__()

    def depends_on(self, recording: Sequence[Frame]) -> Window:
        return self.window

    def _judged(self, scans: WindowOfScans) -> Judgement:
        frame = scans.judged.frame
        if frame.number in self.bad:
            error = derain.InputError("network", f"fails at {frame.number}", "Mend it.")
            raise ScanError(frame, error)
        return super()._judged(scans)


@pytest.fixture(scope="module")
def recording() -> Source:
    """A recording in memory."""
    return derain.Frames.of_scans([scene(60, seed=seed) for seed in range(SCANS)])


@given(
    bad=st.frozensets(st.integers(0, SCANS - 1)),
    block=st.integers(1, SCANS),
    past=st.integers(0, 2),
    delay=st.integers(0, 2),
)
def test_each_scan_of_a_unit_has_one_outcome_whichever_fail(
    recording, bad, block, past, delay
) -> None:
    method = Failing(Window(past, delay), bad)
    out = Destination("out", None, CleanSink)
    for unit in units_of(recording, method, block):
        work = UnitCleaning(method, "", out, 1.0, None)
        outcomes = list(work.results(unit, lambda frame, *_: ScanOutcome(frame, [])))
        assert [each.frame for each in outcomes] == list(unit.frames)  # each when it is met
        failed = [each for each in outcomes if each.error is not None]
        assert all(each.error.subject == each.frame.name for each in failed)
        numbers = {each.frame.number for each in failed}
        assert numbers == bad & {frame.number for frame in unit.frames}


def test_poses_that_units_find_are_those_of_one_run(drive, tmp_path) -> None:
    for poses in drive.rglob("poses.txt"):
        poses.unlink()
    source, method = derain.named_frames(drive), derain.PersistenceDerainer(threads=1)
    out, every = tmp_path / "units", WeatherOptions(every_scan=True)
    whole = clean(source, method, tmp_path / "whole", weather=every)
    units = Division(2, keep_records=True)
    for _ in range(2):
        report = clean(source, method, out, weather=every, division=units)
        assert contents(tmp_path / "whole") == contents(out)
        assert [scan.weather for scan in report.scans] == [scan.weather for scan in whole.scans]
    assert report.before == SCANS  # and not those of the recording of which a scan failed


def test_other_poses_are_other_inputs(drive) -> None:
    method = derain.PersistenceDerainer()
    source = derain.named_frames(drive)

    def inputs(source: Source) -> list[str]:
        return [unit.inputs for unit in units_of(source, method, 2)]

    given = source.map(lambda frame: frame.with_pose(np.eye(4)))
    assert not set(inputs(source)) & set(inputs(given))
    before = inputs(source)
    poses = next(drive.rglob("second/velodyne/poses.txt"))
    poses.write_text(poses.read_text() + "\n")
    after = inputs(derain.named_frames(drive))
    changed = [one != other for one, other in zip(before, after, strict=True)]
    assert changed == [*[False] * 4, *[True] * 4]


@pytest.mark.parametrize("storage", ["mcap", "ros1"])
def test_bags_in_units_are_those_of_one_run(tmp_path, storage) -> None:
    source = derain.named_frames(small_bag(tmp_path, storage))
    method = derain.FilterDerainer(derain.DROR(), threads=1)
    division = Division(1, keep_records=True)
    clean(source, method, tmp_path / "whole")
    with WorkerPool(1) as pool:
        clean(source, method, tmp_path / "units", division=division, executor=pool)
    assert contents(tmp_path / "whole") == contents(tmp_path / "units")
    report = clean(source, method, tmp_path / "units", division=division)
    assert report.before == len(source)


def test_ids_come_from_paths_and_not_from_what_else_is_there(drive) -> None:
    method = derain.FilterDerainer(derain.DROR())

    def ids(source: Source) -> list[str]:
        return [unit.id for unit in units_of(source, method, block=3)]

    source = derain.named_frames(drive)
    assert ids(source)[:3] == [f"first/velodyne/{number:06d}" for number in (0, 3, 6)]
    assert ids(derain.Frames(source[SCANS:])) == ids(source)[3:]


def test_a_changed_scan_is_done_again_with_the_blocks_that_see_it(drive, tmp_path) -> None:
    (drive / "sequences/first/velodyne/000003.bin").unlink()
    method, division = derain.PersistenceDerainer(), Division(2, keep_records=True)

    first = clean(derain.named_frames(drive), method, tmp_path / "out", division=division)
    scene(300, seed=5).tofile(drive / "sequences/second/velodyne/000002.bin")
    again = clean(derain.named_frames(drive), method, tmp_path / "out", division=division)
    assert len(first.scans) == len(again.scans) == 2 * SCANS - 1
    # Blocks 0-1 and 2-3 of the second recording: the first of them sees scan 2 as well.
    assert again.before == len(again.scans) - 4


def test_methods_that_find_poses_see_whole_recordings(drive) -> None:
    for poses in drive.rglob("poses.txt"):
        poses.unlink()
    for method in (derain.PersistenceDerainer(), RecordedDerainer(derain.Derainer())):
        units = units_of(derain.named_frames(drive), method, 2)
        assert [len(unit.frames) for unit in units] == [SCANS, SCANS]
