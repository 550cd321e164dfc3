"""``derain run`` and ``derain status`` by URLs of an object store: the bytes of a local run."""

import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest
from contents import contents
from recorded_scenes import write_drive
from small_bags import small_bag

import derain
from benchmarks.s3_server import BUCKET, Faults, file_system, s3_server
from derain.errors import InputError
from derain.stores.objects import fetch

FAULTS = Faults()
OPTIONS = ("--block", 2, "--most-removed", 1)
SCANS = 5


@pytest.fixture(scope="module")
def server() -> Iterator[None]:
    with s3_server(FAULTS):
        yield


@pytest.fixture
def s3(server, monkeypatch) -> Iterator[Any]:
    """The file system of a server that is empty, and works unless it is made to fail."""
    monkeypatch.setattr("derain.stores.objects.WAITS", (0.01,) * 20)
    files = file_system()
    yield files
    FAULTS.refuse = FAULTS.cut = 0
    for name in files.ls(BUCKET):
        files.rm(name, recursive=True)


@pytest.fixture
def drive(tmp_path) -> Path:
    """A recording with poses."""
    return write_drive(tmp_path / "drive", SCANS, 200, seed=7)


def in_store(s3: Any, folder: str) -> dict[str, bytes]:
    """The results in a folder of the store by their paths."""
    keys = [key for key in s3.find(f"{BUCKET}/{folder}") if "/.derain/" not in key]
    return {key.removeprefix(f"{BUCKET}/{folder}/"): s3.cat_file(key) for key in keys}


def test_a_store_that_fails_gives_the_bytes_of_a_folder_and_a_second_run_does_nothing(
    succeed, s3, drive, tmp_path
) -> None:
    s3.put(f"{drive}/", f"{BUCKET}/drive/", recursive=True)
    succeed("run", "persistence", drive, "--out", tmp_path / "out", *OPTIONS)
    FAULTS.refuse, FAULTS.cut = 10, 7
    command = ("run", "persistence", "s3://drives/drive/", "--out", "s3://drives/out", *OPTIONS)
    first = succeed(*command)
    again = succeed(*command)
    FAULTS.refuse = FAULTS.cut = 0
    assert in_store(s3, "out") == contents(tmp_path / "out")
    assert len(in_store(s3, "out")) == 2 * SCANS
    assert first.out.startswith("s3://drives/drive/000000.bin: ")
    assert f"{SCANS} scans ({SCANS} of them done before)" in again.out
    assert "not-to-be-printed" not in first.out + first.err
    assert "3 of 3 units done" in succeed("status", "s3://drives/out").out


def test_processes_in_another_folder_do_what_is_in_a_store(s3, drive, tmp_path) -> None:
    s3.put(str(drive), f"{BUCKET}/drive", recursive=True)
    method = derain.FilterDerainer(derain.DROR(), threads=1)
    elsewhere = {"initializer": os.chdir, "initargs": (tmp_path,)}
    with ProcessPoolExecutor(1, get_context("spawn"), **elsewhere) as executor:
        source, out = (f"s3://{BUCKET}/{name}" for name in ("drive", "out"))
        report = derain.clean(source, method, out, most_removed=1, executor=executor)
    assert (len(report.scans), report.not_cleaned) == (SCANS, 0)
    assert len(in_store(s3, "out")) == 2 * SCANS


@pytest.mark.parametrize(("storage", "posed"), [("mcap", True), ("ros1", False)])
def test_a_bag_of_a_store_is_cleaned_as_one_of_a_folder(
    succeed, s3, drive, tmp_path, storage, posed
) -> None:
    (tmp_path / "bags").mkdir()
    small_bag(tmp_path / "bags", storage)
    s3.put(f"{tmp_path / 'bags'}/", f"{BUCKET}/bags/", recursive=True)
    trajectory = drive / "poses.txt"
    trajectory.write_text("\n".join(trajectory.read_text().splitlines()[:3]))
    options = (*OPTIONS, "--poses", trajectory) if posed else OPTIONS
    local, table = tmp_path / "local.csv", tmp_path / "stored.csv"
    bag = tmp_path / "bags"
    succeed("run", "persistence", bag, "--out", tmp_path / "out", *options, "--weather", local)
    command = ("run", "persistence", "s3://drives/bags", "--out", "s3://drives/out", *options)
    first = succeed(*command, "--weather", table)
    assert rows_without_names(table) == rows_without_names(local)
    again = succeed(*command, "--weather", table)
    assert rows_without_names(table) == rows_without_names(local)
    assert in_store(s3, "out") == contents(tmp_path / "out")
    assert "s3://drives/bags/drive" in first.out.splitlines()[0]
    assert "3 scans (3 of them done before)" in again.out
    if posed:
        trajectory.write_text(trajectory.read_text().replace("0.3", "0.4"))
        assert "done before" not in succeed(*command, "--weather", table).out


def rows_without_names(table: Path) -> list[list[str]]:
    """The rows of a table of the weather, alarms among them, without the names of the scans."""
    rows = [line.split(",")[1:] for line in table.read_text().splitlines()]
    assert len(rows) == 4
    return rows


def test_results_that_were_removed_or_replaced_are_written_again(succeed, s3, drive) -> None:
    s3.put(f"{drive}/", f"{BUCKET}/drive/", recursive=True)
    command = ("run", "dror", "s3://drives/drive/", "--out", "s3://drives/out", *OPTIONS)
    succeed(*command)
    results = in_store(s3, "out")
    s3.rm(f"{BUCKET}/out/000001.label")
    s3.pipe(f"{BUCKET}/out/000004.bin", bytes(len(results["000004.bin"])))
    again = succeed(*command)
    assert f"{SCANS} scans ({SCANS - 3} of them done before)" in again.out
    assert in_store(s3, "out") == results


def test_what_cannot_be_read_is_listed_and_done_by_the_next_run(
    run_derain, succeed, s3, drive, monkeypatch
) -> None:
    s3.put(f"{drive}/", f"{BUCKET}/drive/", recursive=True)
    command = ("run", "dror", "s3://drives/drive/", "--out", "s3://drives/out", *OPTIONS)

    def fetch_others(objects: Any) -> None:
        for stored in objects.values():
            if stored.path.name == "000002.bin":
                raise InputError(stored.url, "a request failed", "Run it again.")
        fetch(objects)

    with monkeypatch.context() as broken:
        broken.setattr("derain.stores.mirror.fetch", fetch_others)
        outcome = run_derain(*command)
    assert outcome.code == 2
    assert "s3://drives/drive/000002.bin" in outcome.err
    assert f"2 of {SCANS} scans" in outcome.err
    assert "2 of 3 units done, 1 failed" in run_derain("status", "s3://drives/out").out
    assert f"({SCANS - 2} of them done before)" in succeed(*command).out


@pytest.mark.parametrize(
    ("scans", "out", "part"),
    [
        ("s3://drives/nothing", "out", "s3://drives/nothing"),
        ("s3://drives/drive", "s3://drives/drive", "s3://drives/drive/000000.bin"),
        ("s3://drives/bags", "s3://drives/bags", "s3://drives/bags/drive"),
        ("s3://drives/drive", "https://me:secret@host/out?key=secret", "https://host/out"),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_line(
    refused, s3, drive, tmp_path, scans, out, part
) -> None:
    small_bag(tmp_path / "bags", "mcap")
    s3.put(f"{drive}/", f"{BUCKET}/drive/", recursive=True)
    s3.put(f"{tmp_path / 'bags'}/", f"{BUCKET}/bags/", recursive=True)
    place = out if "://" in out else tmp_path / out
    line = refused("run", "dror", scans, "--out", place)
    assert part in line
    assert "secret" not in line
