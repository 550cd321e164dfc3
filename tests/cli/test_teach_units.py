"""``derain teach`` in units: the same labels and figures by processes, shards, and after a stop."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from derain.annotation.manifest import CARD, LABELS, TAUGHT_MANIFEST, Manifest
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels
from derain.jobs.job import FOLDER

POINTS = 200


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """Seven scans with labels of WADS, of which every tenth point is snow."""
    folder = tmp_path / "drive/velodyne"
    folder.mkdir(parents=True)
    for number in range(7):
        scene(POINTS, number).tofile(folder / f"{number:06d}.bin")
        truth = np.where(np.arange(POINTS) % 10, 10, 110)
        write_labels(folder.parent / f"labels/{number:06d}.label", truth)
    return folder


def command(drive: Path, out: Path, *options: object) -> tuple[object, ...]:
    poses = ("--poses", "standing")
    return ("teach", "persistence", drive, "--out", out, *poses, "--card", "wads", *options)


def files(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and FOLDER not in path.parts
    }


def facts(printed: str) -> list[dict[str, Any]]:
    """The objects of the scans, without times."""
    found = [json.loads(line) for line in printed.splitlines()]
    for each in found:
        del each["milliseconds"]
    return found


def test_workers_write_and_count_what_one_process_does_without_records(
    succeed, drive: Path, tmp_path: Path
) -> None:
    whole = succeed(*command(drive, tmp_path / "whole", "--json"))
    units = succeed(*command(drive, tmp_path / "units", "--json", "--workers", 2, "--block", 3))
    assert files(tmp_path / "units") == files(tmp_path / "whole")
    assert facts(units.out) == facts(whole.out)
    assert units.err == whole.err
    assert not (tmp_path / "whole" / FOLDER).exists()


def test_what_was_stopped_goes_on_with_the_same_figures(
    succeed, drive: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    options = ("--block", 2)
    first = succeed(*command(drive, out, *options, "--json"))
    before = files(out)
    kept = out / FOLDER / "labels/000000.label"
    written = kept.stat().st_mtime_ns
    (out / FOLDER / "units/000002.json").unlink()
    (out / FOLDER / "labels/000005.label").unlink()
    for name in (TAUGHT_MANIFEST, CARD):
        (out / name).unlink()
    shutil.rmtree(out / LABELS)
    again = succeed(*command(drive, out, *options, "--json"))
    assert files(out) == before
    assert facts(again.out) == facts(first.out)
    assert kept.stat().st_mtime_ns == written


def test_shards_put_the_labels_in_place_when_the_last_is_done(
    succeed, drive: Path, run_derain, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    succeed(*command(drive, tmp_path / "whole"))
    for number in (2, 0):
        outcome = succeed(*command(drive, out, "--block", 2, "--shard", f"{number}/3"))
        assert f"derain status {out}" in outcome.out
        with pytest.raises(InputError):
            Manifest.read(out)
    status = run_derain("status", out)
    assert (status.code, status.out.splitlines()[-1]) == (2, "to be run again: --array=1")
    succeed(*command(drive, out, "--block", 2, "--shard", "1/3"))
    assert files(out) == files(tmp_path / "whole")
    assert "4 of 4 units done" in succeed("status", out).out


def test_scans_that_fail_are_left_out_of_a_whole_run_and_done_later(
    succeed, run_derain, drive: Path, tmp_path: Path
) -> None:
    out, scan = tmp_path / "out", drive / "000003.bin"
    content = scan.read_bytes()
    scan.write_bytes(b"12345")
    outcome = run_derain(*command(drive, out, "--block", 2))
    assert outcome.code == 2
    assert [each.number for each in Manifest.read(out).scans] == [0, 1, 2, 4, 5, 6]
    scan.write_bytes(content)
    succeed(*command(drive, out, "--block", 2))
    succeed(*command(drive, tmp_path / "whole"))
    assert files(out) == files(tmp_path / "whole")


def test_other_options_are_refused_until_all_is_done_anew(
    succeed, refused, drive: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    succeed("teach", "dror", drive, "--out", out, "--resume")
    before = files(out)
    line = refused("teach", "ror", drive, "--out", out)
    for part in (str(out), "method was dror and is ror", "--anew"):
        assert part in line
    assert files(out) == before
    succeed("teach", "ror", drive, "--out", out, "--anew")
    assert Manifest.read(out).teacher["method"] == "ror"
