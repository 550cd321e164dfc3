"""A Dask cluster as an executor, and schedulers that are not there."""

from concurrent.futures import CancelledError, Future
from types import SimpleNamespace
from typing import Any

import pytest
from jobs.counting import Counting

from derain.errors import InputError
from derain.jobs.cluster import Work, dask_executor
from derain.jobs.job import Job
from derain.jobs.running import Task, run
from derain.jobs.unit import Unit

distributed = pytest.importorskip("distributed", reason="needs derain[cluster]")


def test_a_cluster_does_the_units_of_a_job_and_repeats_one_whose_worker_dies(tmp_path) -> None:
    units = [Unit(id=str(number), size=1, inputs="") for number in range(5)]
    work = Counting(tmp_path, failing=("3",), killing_once=("1",))
    task = Task(Job.begin(tmp_path, {"command": "count"}, units)[0], work)
    options = {"processes": True, "dashboard_address": None, "threads_per_worker": 1}
    with (
        distributed.LocalCluster(n_workers=2, protocol="tcp://", **options) as cluster,
        dask_executor(cluster.scheduler_address) as executor,
    ):
        found = [result for _, result, _ in run(task, units, executor)]
    contents = [each.content for each in found]
    assert contents == ["0 done", "1 done", "2 done", None, "4 done"]
    assert found[3].error.reason == "is broken"
    assert len((tmp_path / "1.tries").read_text().splitlines()) == 2


def test_a_call_whose_scheduler_is_gone_ends_though_its_future_never_does() -> None:
    work = Work(Future(), SimpleNamespace(status="closed"))
    assert not work.done()
    with pytest.raises(CancelledError):
        work.result()


def test_a_scheduler_that_is_not_there_is_one_line(tmp_path) -> None:
    (tmp_path / "scheduler.json").write_text("{}")
    for address in ("tcp://127.0.0.1:9", "nowhere", str(tmp_path / "scheduler.json")):
        with pytest.raises(InputError, match="no scheduler answers at"), dask_executor(address):
            pass


@pytest.mark.parametrize("version", ["0.1.9", None])
def test_workers_with_another_derain_or_none_are_one_line(monkeypatch, version) -> None:
    def versions(client: distributed.Client, packages: list[str]) -> dict[str, Any]:
        of_worker = {"tcp://worker:1": {"packages": dict.fromkeys(packages, version)}}
        return {"client": {"packages": dict.fromkeys(packages, "9.0")}, "workers": of_worker}

    monkeypatch.setattr(distributed.Client, "get_versions", versions)
    with (
        distributed.LocalCluster(n_workers=0, protocol="tcp://", dashboard_address=None) as cluster,
        pytest.raises(InputError, match=rf"--dask: .*9\.0.*{version or 'none'}.*Install the same"),
        dask_executor(cluster.scheduler_address),
    ):
        pass
