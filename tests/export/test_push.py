"""Methods that are given frame after frame: at once, or when those after a frame are there."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer
from derain.filters import FILTERS, FilterDerainer
from derain.scan import Scan
from derain.sources.folders import named_frames
from derain.sources.frame import MemoryFrame
from derain.sources.judgement import Judgement
from derain.sources.source import Frames
from derain.system.stopwatch import Stopwatch
from derain.views.neighbours import NeighbourView
from derain.views.window import Window, WindowOfScans

POINTS = 200


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """A sequence of five scans, with times and with poses that are damaged."""
    folder = tmp_path / "drive/velodyne"
    folder.mkdir(parents=True)
    for number in range(5):
        scene(POINTS, number).tofile(folder / f"{number}.bin")
    (tmp_path / "drive/poses.txt").write_text("damaged")
    return folder


def as_seen(scan: Scan, before: int, after: int) -> Scan:
    """A scan as the view of the tests below shows it: what is around it shows in intensity."""
    seen = np.full(len(scan), 20 * before + 60 * after, np.float32)
    seen[0] += 1  # measured, as it seems
    return replace(scan, intensity=seen)


@pytest.fixture
def windowed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets the neighbour view ask for two scans before and one after."""

    def of_window(view: NeighbourView, scans: WindowOfScans) -> object:
        return view(as_seen(scans.scan, len(scans.before), len(scans.after)))

    monkeypatch.setattr(NeighbourView, "window", Window(before=2, after=1))
    monkeypatch.setattr(NeighbourView, "of_window", of_window)


def assert_seen(judgement: Judgement, derainer: Derainer, before: int, after: int) -> None:
    expected = derainer.probability(as_seen(judgement.scan, before, after))
    np.testing.assert_array_equal(judgement.probability, expected)
    other = derainer.probability(as_seen(judgement.scan, before + 1, after))
    assert (judgement.probability != other).any()


def test_a_frame_is_answered_at_once_as_if_it_were_judged_alone(
    onnx_model: Path, drive: Path
) -> None:
    derainer, stopwatch = Derainer(onnx_model, 1), Stopwatch()
    for frame in named_frames([drive]):
        judgement = derainer.push(frame, stopwatch)  # and nobody asks for its pose
        assert judgement is not None
        assert judgement.frame is frame
        np.testing.assert_array_equal(judgement.probability, derainer.probability(frame.read()))
        assert derainer.waiting == 0
        assert not derainer.starts_new_recording(frame)
    assert list(stopwatch.milliseconds) == ["read", "view", "network", "back"]
    assert list(derainer.flush()) == []


def test_points_are_pushed_as_they_are(onnx_model: Path) -> None:
    derainer, scan = Derainer(onnx_model, 1), Scan.of(scene(POINTS))
    for points in (scan, scene(POINTS)):
        judgement = derainer.push(points)
        assert judgement is not None
        np.testing.assert_array_equal(judgement.rain, derainer(scan))
    judgement = derainer.push(scan)
    assert judgement is not None
    assert judgement.scan is scan
    assert judgement.frame is None


@pytest.mark.parametrize("name", FILTERS)
def test_a_filter_answers_as_a_model_does(name: str, drive: Path) -> None:
    method = FilterDerainer(FILTERS[name](), 1)
    points = scene(POINTS)
    points[5] = np.nan
    for frame in (*named_frames([drive]), MemoryFrame(key="0", scan=Scan.of(points))):
        judgement = method.push(frame)
        scan = frame.read()
        assert judgement.frame is frame
        np.testing.assert_array_equal(judgement.rain, method(scan))
        np.testing.assert_array_equal(judgement.probability, judgement.rain.astype(np.float32))
        np.testing.assert_array_equal(judgement.judged, scan.valid)
    assert (method.waiting, method.starts_new_recording(frame)) == (0, False)
    assert list(method.flush()) == []
    np.testing.assert_array_equal(method.push(points).rain, method(points))


@pytest.mark.usefixtures("windowed")
def test_a_window_is_answered_when_it_is_whole_and_at_the_end(onnx_model: Path) -> None:
    derainer = Derainer(onnx_model, 1)
    scans = [Scan.of(scene(POINTS, seed)) for seed in range(4)]
    frames = [*Frames.of_scans(scans)]
    answers = [derainer.push(frame) for frame in frames]
    assert [answer and answer.frame for answer in answers] == [None, *frames[:3]]
    assert derainer.waiting == 1
    for before, answer in zip((0, 1, 2), answers[1:], strict=True):
        assert answer is not None
        assert_seen(answer, derainer, before, after=1)
    (last,) = derainer.flush()
    assert last.frame is frames[3]
    assert_seen(last, derainer, before=2, after=0)
    assert derainer.waiting == 0


@pytest.mark.usefixtures("windowed")
def test_points_without_a_frame_are_one_sequence_until_its_end(onnx_model: Path) -> None:
    derainer = Derainer(onnx_model, 1)
    assert derainer.push(scene(POINTS, 0)) is None
    answer = derainer.push(Scan.of(scene(POINTS, 1)))
    assert answer is not None
    assert_seen(answer, derainer, before=0, after=1)
    (frame,) = Frames.of_scans([Scan.of(scene(POINTS))], "another")
    assert derainer.starts_new_recording(frame)
    assert len(list(derainer.flush())) == 1
    assert not derainer.starts_new_recording(frame)  # nothing would be lost
    assert derainer.push(frame) is None
    (answer,) = derainer.flush()
    assert_seen(answer, derainer, before=0, after=0)


@pytest.mark.usefixtures("windowed")
def test_one_of_those_that_wait_does_not_take_the_others_with_it(
    onnx_model: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(NeighbourView, "window", Window(before=0, after=3))
    derainer = Derainer(onnx_model, 1)
    for seed in range(3):
        assert derainer.push(Scan.of(scene(POINTS, seed))) is None
    judge = Derainer.logits

    def failing(self: Derainer, view: object) -> object:
        monkeypatch.setattr(Derainer, "logits", judge)
        raise InputError("model", "its network fails", "Export it.")

    monkeypatch.setattr(Derainer, "logits", failing)
    with pytest.raises(InputError, match="its network fails"):
        list(derainer.flush())
    assert derainer.waiting == 2
    assert len(list(derainer.flush())) == 2


@pytest.mark.usefixtures("windowed")
def test_the_command_line_cleans_every_scan_of_a_drive_by_its_window(
    run_derain, onnx_model: Path, drive: Path, tmp_path: Path
) -> None:
    (drive.parent / "poses.txt").unlink()
    (drive / "2.bin").write_bytes(b"12345")
    out = tmp_path / "out"
    outcome = run_derain("run", onnx_model, drive, "--out", out, "--json")
    assert outcome.code == 2
    assert outcome.said[-1] == "derain: 1 of 5 scans could not be cleaned"
    facts = [json.loads(line) for line in outcome.out.splitlines()]
    assert [Path(item["scan"]).stem for item in facts] == ["0", "1", "3", "4"]
    derainer = Derainer(onnx_model, 1)
    # No window reaches over the scan that cannot be read.
    for number, before, after in ((0, 0, 1), (1, 1, 0), (3, 0, 1), (4, 1, 0)):
        scan = Scan.of(scene(POINTS, number))
        rain = derainer(as_seen(scan, before, after))
        np.testing.assert_array_equal(np.fromfile(out / f"{number}.label", "<u4"), rain)
        assert (out / f"{number}.bin").read_bytes() == scene(POINTS, number)[~rain].tobytes()


@pytest.mark.usefixtures("windowed")
def test_poses_that_a_window_needs_are_told_when_they_are_damaged(
    run_derain, onnx_model: Path, drive: Path, tmp_path: Path
) -> None:
    outcome = run_derain("run", onnx_model, drive, "--out", tmp_path / "out")
    assert outcome.code == 2
    assert outcome.said[0].startswith(f"derain: {drive.parent / 'poses.txt'}: line 1 is not 12")
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("windowed")
@pytest.mark.parametrize("command", ["bench", "tune", "view"])
def test_a_model_of_windows_is_not_measured_on_single_scans(
    run_derain: Callable[..., Any], onnx_model: Path, tmp_path: Path, command: str
) -> None:
    scan = tmp_path / "0.bin"
    scene(50).tofile(scan)
    (tmp_path / "0.label").write_bytes(np.resize(np.array([0, 110], "<u4"), 50).tobytes())
    arguments = {
        "bench": ["--data", scan, "--card", "wads", "--methods", onnx_model],
        "tune": [onnx_model, "--data", scan, "--card", "wads"],
        "view": [scan, "--methods", onnx_model],
    }
    out = tmp_path / ("out.yaml" if command == "tune" else "out.png")
    outcome = run_derain(command, *arguments[command], "--out", out)
    assert outcome.code == 2
    assert "sees the scans around the one that it judges" in outcome.err
    assert not out.exists()
