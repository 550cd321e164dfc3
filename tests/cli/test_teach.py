"""``derain teach``: its labels, what it prints and warns of, in one go, in units and in shards."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contents import contents
from recorded_scenes import write_drive, write_scenes
from window_method import Between, Dimmer

from derain.annotation.manifest import CARD, LABELS, Manifest
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export import methods
from derain.files.labels import read_labels, write_labels
from derain.jobs.job import FOLDER
from derain.sources.method import Method
from derain.system.registry import from_parameters

POINTS = 200


@pytest.fixture(autouse=True)
def between(monkeypatch) -> None:
    """Enters a method of windows, in place of persistence."""

    def made(name: str, parameters: dict[str, Any], *_: object) -> Between:
        return Between(from_parameters(Dimmer, name, parameters))

    enter(monkeypatch, made)


def enter(monkeypatch: pytest.MonkeyPatch, make: Callable[..., Between]) -> None:
    """Has commands make a method by the name ``between``."""
    loaded, is_name = methods.load_method, methods.is_method_name

    def load(name: str, *options: Any) -> Method:
        return make(name, *options) if name == "between" else loaded(name, *options)

    monkeypatch.setattr(methods, "load_method", load)
    monkeypatch.setattr(methods, "is_method_name", lambda word: word == "between" or is_name(word))


@pytest.fixture
def drive(tmp_path) -> Path:
    """Six scans with labels of WADS, of which every tenth point is snow."""
    folder = write_scenes(tmp_path / "drive/velodyne", *6 * [POINTS])
    for number in range(6):
        truth = np.where(np.arange(POINTS) % 10, 10, 110)
        write_labels(folder.parent / f"labels/{number:06d}.label", truth)
    return folder


def test_every_scan_is_printed_and_all_together(succeed, drive, tmp_path) -> None:
    out = tmp_path / "taught"
    outcome = succeed("teach", "between", drive, "--out", out, "--set", "rain_below=7")
    lines = outcome.out.splitlines()
    paths = [str(drive / f"{number:06d}.bin") for number in range(6)]
    assert [line.split(":")[0] for line in lines[:6]] == paths
    assert "100.0% not known" in lines[0]
    labels = read_labels(out / "labels/000002.label", POINTS)
    for id_, name in ((0, "not rain"), (1, "rain"), (255, "not known")):
        assert f" {(labels == id_).mean():.1%} {name}" in lines[2]
    assert lines[6] == "6 scans"
    assert lines[-1].split()[:2] == ["all", "1,200"]
    assert "for the record" not in outcome.out
    assert "no point of it is known" in outcome.err
    assert "2 of 6 scans are left out" in outcome.err
    assert Manifest.read(out).teacher == {"method": "between", "rain_below": 7, "sure_within": 30.0}


def test_scans_alone_are_labelled_by_the_model_that_comes_with_derain_over_the_recording(
    succeed, drive, tmp_path
) -> None:
    for number, words in enumerate(([drive], ["default", drive])):
        succeed("teach", *words, "--out", tmp_path / f"{number}")
        teacher = Manifest.read(tmp_path / f"{number}").teacher
        assert (teacher["method"], teacher["past"], teacher["delay"]) == ("default", 1, 1)


def test_truth_is_measured_for_the_record_where_a_card_explains_it(
    succeed, drive, tmp_path
) -> None:
    (drive.parent / "labels/000003.label").write_bytes(b"garbage")
    outcome = succeed("teach", "dror", drive, "--out", tmp_path / "out", "--card", "wads")
    table = outcome.out.split("for the record only, beside WADS's own labels of 5 scans")[1]
    rows = [line.split() for line in table.splitlines()]
    assert any(row[:2] == ["car", "900"] for row in rows)
    assert any(row[:3] == ["falling-snow", "(rain)", "100"] for row in rows)
    # Garbage hinders nothing.
    assert "not measured" in outcome.err
    assert len(Manifest.read(tmp_path / "out").scans) == 6


@pytest.mark.parametrize(
    ("options", "message", "begun"),
    [
        (["--set", "rain_below=0"], "no rain was found", True),
        (["--set", "sure_within=0"], "is sure of no point", True),
        (["--set", "reach=1"], "it has no parameter reach", False),
        (["--poses", "none.txt"], "none.txt", False),
    ],
)
def test_what_is_wrong_is_named(run_derain, drive, tmp_path, options, message, begun) -> None:
    outcome = run_derain("teach", "between", drive, "--out", tmp_path / "out", *options)
    assert message in outcome.err
    assert (tmp_path / "out").exists() == begun


def test_two_scans_are_all_for_training(run_derain, succeed, drive, tmp_path) -> None:
    for number in range(2, 6):
        (drive / f"{number:06d}.bin").unlink()
    outcome = succeed("teach", "dror", drive, "--out", tmp_path / "out")
    assert "no scan is held out" in outcome.err
    outcome = run_derain("teach", "between", drive, "--out", tmp_path / "windows")
    assert outcome.code == 2
    assert "is sure of no point" in outcome.err


def test_points_that_are_not_known_stay(succeed, drive, tmp_path) -> None:
    command = ["run", "between", drive, "--out", tmp_path / "out", "--poses", "standing"]
    outcome = succeed(*command)
    points = scene(POINTS, 1)
    far = np.linalg.norm(points[:, :3], axis=1) >= 30
    rain = (points[:, 3] < 20) & ~far
    np.testing.assert_array_equal(read_labels(tmp_path / "out/000001.label", POINTS), rain)
    message = f"({rain.mean():.1%} of the valid), {far.mean():.1%} not known, "
    assert message in outcome.out.splitlines()[1]
    facts = json.loads(succeed(*command, "--json").out.splitlines()[1])
    assert (facts["rain"], facts["not_known"]) == (rain.sum(), far.sum())
    outcome = succeed("run", "dror", drive, "--out", tmp_path / "out", "--json")
    assert json.loads(outcome.out.splitlines()[0])["not_known"] is None


@pytest.mark.parametrize("command", ["run", "teach"])
def test_the_sensor_is_where_the_option_places_it(
    succeed, drive, tmp_path, monkeypatch, command
) -> None:
    made: list[Between] = []

    def noted(*_: object) -> Between:
        made.append(Between())
        return made[-1]

    enter(monkeypatch, noted)
    poses = tmp_path / "poses.txt"
    poses.write_text("".join(f"1 0 0 {n} 0 1 0 0 0 0 1 0\n" for n in range(6)))
    for options in ([], ["--poses", poses], ["--poses", "standing"]):
        succeed(command, "between", drive, "--out", tmp_path / "out", *options)
    unknown, read, standing = (method.poses for method in made)
    assert unknown == [None] * 6
    assert [pose[0, 3] for pose in read] == [0, 1, 2, 3, 4, 5]
    np.testing.assert_array_equal(standing, [np.eye(4)] * 6)


def command(drive: Path, out: Path, *options: object) -> tuple[object, ...]:
    poses = ("--poses", "standing")
    return ("teach", "persistence", drive, "--out", out, *poses, "--card", "wads", *options)


def facts(printed: str) -> list[dict[str, Any]]:
    """The objects of the scans, without times."""
    found = [json.loads(line) for line in printed.splitlines()]
    for each in found:
        del each["milliseconds"]
    return found


def test_workers_write_and_count_what_one_process_does_without_records(
    succeed, drive, tmp_path
) -> None:
    whole = succeed(*command(drive, tmp_path / "whole", "--json"))
    units = succeed(*command(drive, tmp_path / "units", "--json", "--workers", 2, "--block", 3))
    assert contents(tmp_path / "units") == contents(tmp_path / "whole")
    found = facts(whole.out)
    assert facts(units.out) == found
    assert [(Path(each["scan"]).stem, each["points"]) for each in found] == [
        (f"{number:06d}", POINTS) for number in range(6)
    ]
    assert units.err == whole.err
    assert "6 scans" in whole.err
    assert not (tmp_path / "whole" / FOLDER).exists()


def test_what_was_stopped_goes_on_with_the_same_figures(succeed, drive, tmp_path) -> None:
    out = tmp_path / "out"
    options = ("--block", 2)
    first = succeed(*command(drive, out, *options, "--json"))
    before = contents(out)
    kept = out / LABELS / "000001.label"
    written = kept.stat().st_mtime_ns
    (out / FOLDER / "units/000002.json").unlink()
    (out / LABELS / "000004.label").unlink()
    (out / CARD).unlink()
    again = succeed(*command(drive, out, *options, "--json"))
    assert contents(out) == before
    assert facts(again.out) == facts(first.out)
    assert kept.stat().st_mtime_ns == written


def test_units_whose_records_have_other_ranges_are_taught_again(succeed, drive, tmp_path) -> None:
    out, options = tmp_path / "out", ("--block", 2, "--json")
    first = succeed(*command(drive, out, *options))
    for path in (out / FOLDER / "units").iterdir():
        record = json.loads(path.read_text())
        for scan in record["results"]:
            scan["answers"] *= 3
        del record["checksum"]  # as derain 0.2 wrote none
        path.write_text(json.dumps(record))
    again = succeed(*command(drive, out, *options))
    assert facts(again.out) == facts(first.out)


def test_shards_put_the_labels_in_place_when_the_last_is_done(
    succeed, drive, run_derain, tmp_path
) -> None:
    out = tmp_path / "out"
    succeed(*command(drive, tmp_path / "whole"))
    for number in (2, 0):
        outcome = succeed(*command(drive, out, "--block", 2, "--shard", f"{number}/3"))
        assert f"derain status {out}" in outcome.out
        with pytest.raises(InputError):
            Manifest.read(out)
    assert run_derain("status", out).out.splitlines()[-1] == "to be run again: --array=1"
    succeed(*command(drive, out, "--block", 2, "--shard", "1/3"))
    assert contents(out) == contents(tmp_path / "whole")


def test_scans_that_fail_are_left_out_of_a_whole_run_and_done_later(
    succeed, run_derain, tmp_path
) -> None:
    drive = write_drive(tmp_path / "drive", 6, POINTS, seed=0)
    poses = ("--poses", drive / "poses.txt")
    out, scan = tmp_path / "out", drive / "000003.bin"
    content = scan.read_bytes()
    scan.write_bytes(b"12345")
    outcome = run_derain(*command(drive, out, *poses, "--block", 2))
    assert outcome.code == 2
    assert "1 of 6 scans could not be judged" in outcome.err.splitlines()[-1]
    assert [each.number for each in Manifest.read(out).scans] == [0, 1, 2, 4, 5]
    scan.write_bytes(content)
    succeed(*command(drive, out, *poses, "--block", 2))
    succeed(*command(drive, tmp_path / "whole", *poses))
    assert contents(out) == contents(tmp_path / "whole")
