"""``derain view RECORDING --rerun``: what the viewer is given is what ``derain run`` finds."""

from pathlib import Path

import numpy as np
import pytest
from recording_read_back import CLEAR, POSITIONS, ReadBack

from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer
from derain.files import read_scan
from derain.files.labels import read_labels, write_labels
from derain.pictures.entities import CLASS_NOT_KNOWN, CLASS_RAIN

SCANS = 4


@pytest.fixture
def recording(tmp_path) -> Path:
    """Scans of 300 points of which some cannot be judged, with labels of rain in the last 30."""
    folder = tmp_path / "drive/velodyne"
    folder.mkdir(parents=True)
    for number in range(SCANS):
        points = scene(300, seed=number)
        points[number] = np.nan
        points.tofile(folder / f"{number:03}.bin")
        write_labels(tmp_path / f"drive/labels/{number:03}.label", np.repeat([0, 110], [270, 30]))
    return folder


def test_what_is_kept_and_removed_is_what_run_finds(
    succeed, recording, tmp_path, onnx_model
) -> None:
    out = tmp_path / "out.rrd"
    methods = {"net": str(onnx_model), "dror": "dror", "persistence": "persistence"}
    given, poses = [f"{title}={name}" for title, name in methods.items()], ["--poses", "standing"]
    outcome = succeed("view", recording, "--methods", *given, *poses, "--rerun", out)
    first, last = outcome.out.splitlines()
    assert "4 scans" in first
    assert "net, dror, persistence" in first
    assert f"{out}: {out.stat().st_size / 1e6:,.1f} MB" in last
    found = ReadBack(out)
    assert found.blueprints == 1
    scans = [read_scan(recording / f"{number:03}.bin") for number in range(SCANS)]
    points = found.points("/sensor/scan/points")
    assert list(points) == list(range(SCANS))
    for title, name in methods.items():
        succeed("run", name, recording, "--out", tmp_path / title, *poses)
        kept = found.points(f"/sensor/methods/{title}/kept")
        removed = found.points(f"/sensor/methods/{title}/removed")
        shares = found.numbers(f"/share/methods/{title}")
        for number, scan in enumerate(scans):
            rain = read_labels(tmp_path / title / f"{number:03}.label", len(scan)) == 1
            np.testing.assert_array_equal(points[number], scan.xyz[scan.valid])
            np.testing.assert_array_equal(removed[number], scan.xyz[rain])
            np.testing.assert_array_equal(kept[number], scan.xyz[scan.valid & ~rain])
            assert shares[number] == pytest.approx(100 * rain.sum() / scan.valid.sum())
    for number, shown in found.points("/sensor/methods/net/probability").items():
        probable = Derainer(onnx_model).probability(scans[number]) >= 0.01
        np.testing.assert_array_equal(shown, scans[number].xyz[probable])
    # A filter answers yes or no: there is nothing to shade.
    assert not found.points("/sensor/methods/dror/probability")


def test_truth_colours_what_methods_do(succeed, recording, tmp_path) -> None:
    card = tmp_path / "card.yaml"
    card.write_text("{name: ours, classes: {0: a, 110: b, 9: c}, rain: [110], unknown: [9]}")
    labels = np.repeat([9, 0, 110], [100, 170, 30])
    write_labels(recording.parent / "labels/000.label", labels)
    write_labels(recording.parent / "labels/001.label", np.full(300, 9))
    (recording.parent / "labels/002.label").unlink()
    out = tmp_path / "out.rrd"
    succeed("view", recording, "--card", card, "--methods=dror", "--frames", "0:3", "--rerun", out)
    found = ReadBack(out)
    scan = read_scan(recording / "000.bin")
    labelled = np.flatnonzero(scan.valid & (labels != 0))
    np.testing.assert_array_equal(found.points("/sensor/scan/truth")[0], scan.xyz[labelled])
    classed = found.values("/sensor/scan/truth", "Points3D:class_ids")
    assert classed[0] == np.where(labels[labelled] == 110, CLASS_RAIN, CLASS_NOT_KNOWN).tolist()
    assert found.numbers("/share/scan/truth")[0] == pytest.approx(100 * 30 / scan.valid.sum())
    # The scan without labels does not show those of the one before.
    assert list(found.points("/sensor/scan/truth")) == [0, 1]
    assert 2 in found.cleared("/sensor/scan")
    succeed("run", "dror", recording, "--out", tmp_path / "dror")
    called = read_labels(tmp_path / "dror/000.label", 300) == 1
    rain = np.where(labels == 9, called, labels == 110)
    outcome_of = np.select([rain & called, rain, called], [1, 2, 3], default=0)
    kept = found.values("/sensor/methods/dror/kept", "Points3D:class_ids")[0]
    assert kept == outcome_of[scan.valid & ~called].tolist()
    removed = found.values("/sensor/methods/dror/removed", "Points3D:class_ids")[0]
    assert removed == outcome_of[called].tolist()
    captions = [text[0] for text in found.values("/caption", "TextDocument:text").values()]
    assert ["red: solid, lost" in text for text in captions] == [True, True, False]


def test_without_labels_there_is_no_truth(succeed, recording, tmp_path) -> None:
    for label in (recording.parent / "labels").iterdir():
        label.unlink()
    out = tmp_path / "out.rrd"
    options = ["--card", "wads", "--methods", "dror", "--rerun", out]
    (warning,) = succeed("view", recording, *options).messages
    assert f"{recording / '000.bin'}: no scan has labels" in warning
    assert not any("truth" in entity for entity in ReadBack(out).entities)


def test_some_scans_are_shown_and_a_method_of_several_scans_sees_all(
    succeed, recording, tmp_path
) -> None:
    whole, some = tmp_path / "whole.rrd", tmp_path / "some.rrd"
    options = ["--poses", "standing", "--methods", "persistence"]
    succeed("view", recording, *options, "--rerun", whole)
    succeed("view", recording, *options, "--frames", "1::2", "--rerun", some)
    entity = "/sensor/methods/persistence/removed"
    of_all, of_some = (ReadBack(file).points(entity) for file in (whole, some))
    assert list(of_some) == [1, 3]
    for number, points in of_some.items():
        np.testing.assert_array_equal(points, of_all[number])


def test_scans_lie_where_and_when_they_were_taken(succeed, recording, tmp_path) -> None:
    poses = np.tile(np.eye(4)[:3], (SCANS, 1, 1))
    poses[:, 0, 3] = 4_000_000 + np.arange(SCANS)  # as maps count, where float32 knows no metres
    np.savetxt(recording.parent / "poses.txt", poses.reshape(SCANS, 12))
    np.savetxt(recording.parent / "times.txt", 1e9 + 0.1 * np.arange(SCANS))
    out = tmp_path / "out.rrd"
    succeed("view", recording, "--rerun", out)
    found = ReadBack(out)
    assert len(found.points("/sensor/methods/default/kept")) == SCANS
    moved = found.values("/sensor", "Transform3D:translation")
    assert {n: value[0] for n, value in moved.items()} == {n: [n, 0, 0] for n in range(SCANS)}
    assert found.seconds == pytest.approx({n: 0.1 * n for n in range(SCANS)}, abs=1e-6)
    assert found.timelines == {"frame", "time"}


def test_a_scan_that_cannot_be_read_is_reported_once_and_shown_empty(
    run_derain, recording, tmp_path
) -> None:
    (recording / "002.bin").write_bytes(b"no scan")
    out = tmp_path / "out.rrd"
    options = ["--methods", "dror", "persistence", "--poses", "standing", "--rerun", out]
    outcome = run_derain("view", recording, *options)
    assert outcome.code == 2
    assert outcome.err.count("002.bin") == 1
    assert "4 scans" in outcome.err.splitlines()[-1]
    found = ReadBack(out)
    assert list(found.points("/sensor/scan/points")) == [0, 1, 3]
    assert list(found.points("/sensor/methods/dror/kept")) == [0, 1, 3]
    for entity, points in (
        ("/sensor/scan", "points"),
        ("/sensor/methods/dror", "kept"),
        ("/sensor/methods/persistence", "kept"),
    ):
        cleared, written = found.rows(entity, CLEAR), found.rows(f"{entity}/{points}", POSITIONS)
        assert list(cleared) == list(range(SCANS))
        assert all(cleared[number] < row for number, row in written.items())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--rerun", "out.png"], "out.png: must end in .rrd"),
        (["--rerun", "out.rrd", "--frames", "9:"], "none of them is among the 4 scans"),
        (["--rerun", "out.rrd", "--frames", "::0"], "::0 is not FROM:TO[:STEP]"),
        (["--rerun", "out.rrd", "--methods", "nothing"], "nothing: no such method or file"),
        (
            ["--rerun", "out.rrd", "--methods", "dror", "dror"],
            "dror: it is the title of two methods",
        ),
        (["--rerun", "out.rrd", "--out", "out.png"], "cannot be combined with --out or --window"),
        (["--out", "out.png"], "a folder"),
    ],
)
def test_what_cannot_be_meant_is_refused_and_nothing_is_written(
    refused, recording, here, options, message
) -> None:
    assert message in refused("view", recording, *options)
    assert [file.name for file in here.iterdir()] == ["drive"]


def test_a_full_disk_ends_the_work_with_a_message_and_leaves_what_was_there(
    run_derain, recording, tmp_path, full_disk
) -> None:
    """Rerun's library by itself waits for ever where its file may not grow."""
    out = tmp_path / "out.rrd"
    out.write_bytes(b"as it was")
    full_disk()
    outcome = run_derain("view", recording, "--methods", "dror", "--rerun", out)
    assert outcome.code == 2
    assert f"{out}: cannot be written (File too large)" in outcome.err
    assert out.read_bytes() == b"as it was"
    assert {file.name for file in tmp_path.iterdir()} == {"drive", "out.rrd"}
