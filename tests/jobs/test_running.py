"""Jobs: each unit done once, what failed done again, and nothing done by other options."""

import json
from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
from jobs.counting import Counting

from derain.errors import InputError
from derain.jobs.job import Job, job_status
from derain.jobs.running import Task, UnfitWorkerError, run
from derain.jobs.shard import Shard
from derain.jobs.unit import Unit
from derain.jobs.workers import TRIES, WorkerPool

OPTIONS = {"command": "count", "size": 3}
UNITS = [Unit(id=f"drive/{place}", size=1, inputs="unchanged") for place in range(5)]
EXECUTORS: list[Callable[[], Executor]] = [
    lambda: WorkerPool(2),
    lambda: ThreadPoolExecutor(2),
    lambda: ProcessPoolExecutor(2),
]


@pytest.fixture
def out(tmp_path) -> Path:
    (tmp_path / "drive").mkdir()
    return tmp_path


def begun(out: Path, units: list[Unit] = UNITS, **options: object) -> Job:
    return Job.begin(out, {**OPTIONS, **options}, units)[0]


def tries(out: Path, unit: str) -> int:
    return len((out / f"{unit}.tries").read_text().splitlines())


def results(
    out: Path, work: Counting, executor: Executor | None = None, units: list[Unit] = UNITS
) -> list[tuple[str, bool]]:
    found = run(Task(begun(out, units), work), units, executor)
    return [(value.content or str(value.error), before) for _, value, before in found]


def test_a_second_run_does_nothing_again(out) -> None:
    assert results(out, Counting(out)) == [(f"{unit.id} done", False) for unit in UNITS]
    assert results(out, Counting(out)) == [(f"{unit.id} done", True) for unit in UNITS]
    assert all(tries(out, unit.id) == 1 for unit in UNITS)


@pytest.mark.parametrize("executor", EXECUTORS)
def test_executors_give_the_same_in_the_same_order(out, executor) -> None:
    with executor() as pool:
        found = results(out, Counting(out, failing=("drive/2",)), pool)
    done = [f"{unit.id} done" for unit in UNITS]
    done[2] = "drive/2: is broken. Mend it."
    assert found == [(each, False) for each in done]
    (failed,) = job_status(out, lambda record: None).failed
    assert failed.unit == "drive/2"


def test_units_that_failed_changed_or_lost_their_files_are_done_again(out) -> None:
    results(out, Counting(out, failing=("drive/0",)))
    (out / "drive" / "1.txt").unlink()
    (out / ".derain" / "units" / "drive" / "2.json").write_text('{"half": ')
    changed = [*UNITS[:3], replace(UNITS[3], inputs="changed"), UNITS[4]]
    results(out, Counting(out), units=changed)
    assert [tries(out, unit.id) for unit in UNITS] == [2, 2, 2, 2, 1]


def test_a_record_that_was_changed_by_hand_is_none(out) -> None:
    results(out, Counting(out))
    path = out / ".derain" / "units" / "drive" / "1.json"
    record = json.loads(path.read_bytes())
    path.write_text(json.dumps({**record, "seconds": "few"}))
    assert [unit.id for unit in job_status(out, lambda record: None).missing] == ["drive/1"]
    results(out, Counting(out))
    assert [tries(out, unit.id) for unit in UNITS] == [1, 2, 1, 1, 1]


def test_other_options_are_refused_and_named(out) -> None:
    results(out, Counting(out))
    with pytest.raises(InputError, match="size was 3 and is 4"):
        begun(out, size=4)
    with pytest.raises(InputError, match="colour was not there and is red"):
        begun(out, colour="red")
    with pytest.raises(InputError, match="b was not there and is 2, and 1 more"):
        begun(out, size=4, a=1, b=2, c=3)
    anew, _ = Job.begin(out, {**OPTIONS, "size": 4}, UNITS, anew=True)
    assert next(anew.records_of(UNITS)) == (UNITS[0], None)


def test_a_record_of_other_options_does_not_count(out) -> None:
    results(out, Counting(out))
    other = replace(begun(out), options={**OPTIONS, "size": 4})
    assert [record for _, record in other.records_of(UNITS)] == [None] * len(UNITS)


def test_a_unit_that_kills_its_process_is_passed_over_after_three_tries(out) -> None:
    with WorkerPool(2) as pool:
        found = results(out, Counting(out, killing=("drive/1",)), pool)
    assert tries(out, "drive/1") == TRIES
    assert [each.partition(" ")[2] for each, _ in found[2:]] == ["done"] * 3
    (failed,) = job_status(out, lambda record: None).failed
    assert f"died {TRIES} times" in failed.errors[0][1]


@pytest.mark.parametrize("executor", EXECUTORS)
def test_processes_that_cannot_do_the_work_end_it_with_one_reason(out, executor) -> None:
    with executor() as pool, pytest.raises(UnfitWorkerError, match=r"worker .*model\.onnx"):
        results(out, Counting(out, unfit=True), pool)
    assert len(job_status(out, lambda record: None).missing) == 5


def test_processes_of_another_version_or_folder_are_refused(out) -> None:
    job, work = begun(out), Counting(out)
    with pytest.raises(InputError, match=r"this command 0\.0\.1"):
        Task(job, work, version="0.0.1").check()
    with pytest.raises(InputError, match=f"they begin in {out}"):
        Task(job, work, folder=out).check()
    Task(job, work, folder=Path.cwd()).check()


def test_an_executor_that_has_ended_is_reported_and_the_rest_is_done_later(out) -> None:
    with ProcessPoolExecutor(1) as pool, pytest.raises(InputError, match="ended before drive/"):
        results(out, Counting(out, killing=("drive/1",)), pool)
    assert results(out, Counting(out))[0] == ("drive/0 done", True)


def test_an_executor_that_had_ended_before_is_reported(out) -> None:
    pool = ThreadPoolExecutor(1)
    pool.shutdown()
    with pytest.raises(InputError, match="executor: it ended before drive/0"):
        results(out, Counting(out), pool)


def test_the_status_names_what_is_to_be_done_again(out) -> None:
    job, _ = Job.begin(out, OPTIONS, UNITS, Shard(0, 5, first=1))
    done = UNITS[:2]
    list(run(Task(job, Counting(out, failing=("drive/0",))), done))
    recorded: list[str] = []
    status = job_status(out, lambda record: recorded.append(record.unit))
    assert (status.done, recorded) == (1, ["drive/1"])
    assert [record.unit for record in status.failed] == ["drive/0"]
    assert [unit.id for unit in status.missing] == ["drive/2", "drive/3", "drive/4"]
    assert status.array == "1,3-5"


def test_a_folder_without_a_job_has_no_status(out) -> None:
    (out / ".derain").mkdir()
    with pytest.raises(InputError, match="no records of a job"):
        Job.at(out)
    broken = [{"options": 3, "shards": None}, *({"options": {}, "shards": s} for s in ("a", [1]))]
    for content in ("", "[]", *map(json.dumps, broken)):
        (out / ".derain" / "job.json").write_text(content)
        with pytest.raises(InputError, match=r"job\.json, are damaged"):
            Job.at(out)
    (out / ".derain" / "job.json").write_text(json.dumps({"options": {}, "shards": None}))
    for listed in ("", '[["drive/0", "large", ""]]'):
        (out / ".derain" / "units.json").write_text(listed)
        with pytest.raises(InputError, match="not listed"):
            job_status(out, lambda record: None)
