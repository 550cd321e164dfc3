"""Sources in units: the union of units gives what one run gives, byte for byte."""

from pathlib import Path

import numpy as np
import pytest
from small_bags import small_bag

import derain
from derain.evaluation.hard_cases import scene
from derain.export.recorded import RecordedDerainer
from derain.jobs.shard import Shard
from derain.jobs.workers import WorkerPool
from derain.sources.method import Method
from derain.sources.source import Source
from derain.sources.units import Division, units_of
from derain.sources.weather_monitor import WeatherOptions

SCANS = 7


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """Two recordings with poses, in which scan 3 of the first cannot be read."""
    for place, name in enumerate(("first", "second")):
        folder = tmp_path / "drives" / "sequences" / name / "velodyne"
        folder.mkdir(parents=True)
        poses = []
        for number in range(SCANS):
            points = scene(400, seed=7 * place)
            points[:, 0] -= 0.3 * number
            points[:40, :3] = np.random.default_rng(number).uniform(-6, 6, (40, 3))
            points.tofile(folder / f"{number:06d}.bin")
            poses.append(f"1 0 0 {0.3 * number} 0 1 0 0 0 0 1 0")
        (folder / "poses.txt").write_text("\n".join(poses))
    (tmp_path / "drives/sequences/first/velodyne/000003.bin").write_bytes(b"broken")
    return tmp_path / "drives"


def written(out: Path) -> dict[str, bytes]:
    """What is in the files of a folder but for the records, by their paths."""
    files = [path for path in out.rglob("*") if path.is_file() and ".derain" not in path.parts]
    return {str(path.relative_to(out)): path.read_bytes() for path in files}


METHODS = {
    "a filter": lambda: derain.FilterDerainer(derain.DROR()),
    "persistence": lambda: derain.PersistenceDerainer(),
    "a model over recordings": lambda: RecordedDerainer(derain.Derainer(), past=2, delay=1),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("block", [1, 2, 50])
def test_the_union_of_units_is_what_one_run_gives(
    drive: Path, tmp_path: Path, method: str, block: int
) -> None:
    source, every = derain.named_frames(drive), WeatherOptions(every_scan=True)
    reports = [
        derain.clean(
            source, METHODS[method](), tmp_path / name, most_removed=1, weather=every, division=each
        )
        for name, each in (("whole", None), ("units", Division(block, resume=True)))
    ]
    assert written(tmp_path / "whole") == written(tmp_path / "units")
    assert len(written(tmp_path / "whole")) == 2 * (2 * SCANS - 1)
    whole, units = ([scan.weather for scan in report.scans] for report in reports)
    assert whole == units
    assert [report.not_cleaned for report in reports] == [1, 1]


def test_shares_and_workers_give_the_same_and_a_last_run_finds_everything_done(
    drive: Path, tmp_path: Path
) -> None:
    method = derain.FilterDerainer(derain.DROR(), threads=1)
    (drive / "sequences/first/velodyne/000003.bin").unlink()
    source = derain.named_frames(drive)
    derain.clean(source, method, tmp_path / "whole", most_removed=1)
    for number in range(3):
        share = Division(2, Shard(number, 3))
        derain.clean(source, method, tmp_path / "shares", most_removed=1, division=share)
    blocks = Division(2)
    with WorkerPool(2) as pool:
        derain.clean(
            source, method, tmp_path / "workers", most_removed=1, division=blocks, executor=pool
        )
    assert written(tmp_path / "whole") == written(tmp_path / "shares")
    assert written(tmp_path / "whole") == written(tmp_path / "workers")
    report = derain.clean(source, method, tmp_path / "shares", most_removed=1, division=blocks)
    assert report.before == len(report.scans) == 2 * SCANS - 1


def test_ids_come_from_paths_and_not_from_what_else_is_there(drive: Path) -> None:
    method = derain.FilterDerainer(derain.DROR())

    def ids(source: Source) -> list[str]:
        return [unit.id for unit in units_of(source, method, block=3)]

    source = derain.named_frames(drive)
    assert ids(source)[:3] == [f"first/velodyne/{number:06d}" for number in (0, 3, 6)]
    assert ids(derain.Frames(source[SCANS:])) == ids(source)[3:]


def test_a_changed_scan_is_done_again_with_the_blocks_that_see_it(
    drive: Path, tmp_path: Path
) -> None:
    (drive / "sequences/first/velodyne/000003.bin").unlink()
    method, division = derain.PersistenceDerainer(), Division(2, resume=True)

    def run() -> derain.CleanReport:
        source = derain.named_frames(drive)
        return derain.clean(source, method, tmp_path / "out", most_removed=1, division=division)

    first = run()
    scene(300, seed=5).tofile(drive / "sequences/second/velodyne/000002.bin")
    again = run()
    assert len(first.scans) == len(again.scans) == 2 * SCANS - 1
    # Blocks 0-1 and 2-3 of the second recording: the first of them sees scan 2 as well.
    assert again.before == len(again.scans) - 4


def test_methods_that_find_poses_see_whole_recordings(drive: Path) -> None:
    for poses in drive.rglob("poses.txt"):
        poses.unlink()
    source = derain.named_frames(drive)
    placed: list[Method] = [derain.PersistenceDerainer(), RecordedDerainer(derain.Derainer())]
    for method in placed:
        assert [len(unit.frames) for unit in units_of(source, method, 2)] == [SCANS, SCANS]


def test_a_bag_is_one_unit(tmp_path: Path) -> None:
    source = derain.named_frames(small_bag(tmp_path, "mcap"))
    (unit,) = units_of(source, derain.FilterDerainer(derain.DROR()), block=1)
    assert (unit.id, len(unit.frames)) == (source[0].key, len(source))
