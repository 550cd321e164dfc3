"""``derain run`` in units: what was stopped goes on, and ``derain status`` prints how far it is."""

import json
import shutil
from pathlib import Path

import pytest
from recorded_scenes import write_scenes

OPTIONS = ("--block", 2, "--most-removed", 1)


@pytest.fixture
def scans(tmp_path) -> Path:
    return write_scenes(tmp_path / "scans", *5 * [200])


def test_a_run_of_more_scans_than_a_block_keeps_records_and_goes_on(
    succeed, scans, tmp_path
) -> None:
    out, table = tmp_path / "out", tmp_path / "weather.csv"
    command = ("run", "dror", scans, "--out", out, *OPTIONS, "--weather", table)
    first = succeed(*command)
    rows = table.read_text()
    assert len(rows.splitlines()) == 6
    (out / ".derain" / "units" / "000002.json").unlink()
    again = succeed(*command)
    assert len(first.out.splitlines()) == 6
    assert [Path(line.partition(":")[0]).stem for line in again.out.splitlines()[:2]] == [
        "000002",
        "000003",
    ]
    assert "5 scans (3 of them done before): 1,000 points" in again.out.splitlines()[2]
    assert table.read_text() == rows


def test_a_run_of_few_scans_keeps_none_without_an_option(succeed, scans, tmp_path) -> None:
    out = tmp_path / "out"
    succeed("run", "dror", scans, "--out", out, "--most-removed", 1)
    assert not (out / ".derain").exists()
    succeed("run", "dror", scans, "--out", out, "--most-removed", 1, "--resume")
    assert (out / ".derain").is_dir()


def test_other_options_are_refused_until_all_is_done_anew(
    succeed, refused, scans, tmp_path
) -> None:
    out = tmp_path / "out"
    succeed("run", "dror", scans, "--out", out, *OPTIONS)
    line = refused("run", "ror", scans, "--out", out, *OPTIONS)
    for part in (str(out), "method was dror and is ror", "--anew"):
        assert part in line
    succeed("run", "ror", scans, "--out", out, *OPTIONS, "--anew")


def test_shares_are_those_of_a_slurm_array_and_the_status_names_what_is_missing(
    run_derain, succeed, scans, tmp_path, monkeypatch
) -> None:
    out = tmp_path / "out"
    monkeypatch.setenv("SLURM_ARRAY_TASK_MIN", "1")
    monkeypatch.setenv("SLURM_ARRAY_TASK_MAX", "3")
    (scans / "000004.bin").write_bytes(b"broken")
    for task in (1, 3):
        monkeypatch.setenv("SLURM_ARRAY_TASK_ID", str(task))
        run_derain("run", "dror", scans, "--out", out, *OPTIONS)
    monkeypatch.delenv("SLURM_ARRAY_TASK_ID")
    outcome = run_derain("status", out, "--json")
    status = json.loads(outcome.out)
    assert outcome.code == 2
    assert (status["units"], status["done"], len(status["missing"])) == (3, 1, 1)
    assert list(status["failed"]) == ["000004"]
    assert status["array"] == "2-3"
    (scans / "000004.bin").unlink()
    shutil.copy(scans / "000000.bin", scans / "000004.bin")
    succeed("run", "dror", scans, "--out", out, *OPTIONS)
    assert "3 of 3 units done, 0 failed, 0 missing" in succeed("status", out).out


def test_the_time_of_units_that_failed_slows_no_worker_down(
    run_derain, succeed, scans, tmp_path
) -> None:
    (scans / "000003.bin").write_bytes(b"broken")
    run_derain("run", "dror", scans, "--out", tmp_path / "out", *OPTIONS)
    status = json.loads(run_derain("status", tmp_path / "out", "--json").out)
    (seconds,) = status["seconds_by_worker"].values()
    assert list(status["failed"]) == ["000002"]
    records = tmp_path / "out/.derain/units"
    done = [json.loads((records / f"{unit}.json").read_text()) for unit in ("000000", "000004")]
    assert seconds == sum(record["seconds"] for record in done)


def test_options_that_exclude_each_other_are_refused(refused, scans, tmp_path) -> None:
    command = ("run", "dror", scans, "--out", tmp_path / "out")
    assert "--anew" in refused(*command, "--anew", "--shard", "0/2")
    assert "0 to 1" in refused(*command, "--shard", "2/2")
    assert "--workers" in refused(*command, "--workers", 2, "--dask", "tcp://127.0.0.1:1")
