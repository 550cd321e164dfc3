"""With onnxruntime's headers, the example in C++ judges as derain judges."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import onnx
import pytest

from derain.default import default_model
from derain.evaluation.hard_cases import scene
from derain.export.onnx_file import with_metadata
from derain.export.runtime import Derainer
from derain.scan import Float32s

from .cpp import Program
from .hard_points import KEPT, SCANS


def judged_alike(
    derain_onnx: Program, folder: Path, model: Path, scans: Iterable[Float32s]
) -> None:
    """Judges scans by the program and by derain, and compares all that they write."""
    paths = {folder / f"{number}.bin": points for number, points in enumerate(scans)}
    for path, points in paths.items():
        points.tofile(path)
    done = derain_onnx("--threads", "1", model, folder / "out", *paths)
    assert (done.returncode, done.stderr) == (0, "")
    derainer = Derainer(model, threads=1)
    for path, points in paths.items():
        rain = derainer(points)
        label = np.fromfile(folder / "out" / f"{path.stem}.label", "<u4")
        np.testing.assert_array_equal(label, rain)
        assert (folder / "out" / path.name).read_bytes() == points[~rain].tobytes()
        assert f"{path}: {len(points)} points, {rain.sum()} rain, view " in done.stdout


@pytest.mark.parametrize("model", [default_model(), KEPT], ids=["default", "outdet"])
def test_it_calls_rain_what_derain_calls_rain(derain_onnx, tmp_path, model) -> None:
    judged_alike(derain_onnx, tmp_path, model, [*SCANS.values(), scene()])


def test_it_judges_candidates_as_well(derain_onnx, judging_candidates, tmp_path) -> None:
    points = SCANS["ties, copies, invalid rows"]
    judged_alike(derain_onnx, tmp_path, judging_candidates, [points])
    assert 0 < Derainer(judging_candidates, threads=1)(points).mean() < 1


def test_and_images_whichever_way_their_scores_come_back(
    derain_onnx, model_of_images, tmp_path
) -> None:
    judged_alike(derain_onnx, tmp_path, model_of_images, [*SCANS.values(), scene(400)])


@pytest.mark.parametrize("text", [b'"numpy"', b'"sha256"'], ids=["versions", "checksum"])
def test_a_model_that_has_changed_is_refused(derain_onnx, tmp_path, text) -> None:
    scene(50).tofile(tmp_path / "scan.bin")
    model = tmp_path / "model.onnx"
    model.write_bytes(default_model().read_bytes().replace(text, text.upper()))
    done = derain_onnx(model, tmp_path / "out", tmp_path / "scan.bin")
    assert done.returncode == 2
    assert "it is not as it was exported: its checksum differs" in done.stderr
    assert not list(tmp_path.glob("out/*"))


def test_a_file_that_is_no_model_of_derain_is_refused(derain_onnx, tmp_path) -> None:
    scene(50).tofile(tmp_path / "scan.bin")
    (tmp_path / "text.onnx").write_text("no model")
    spec = Derainer(KEPT).spec.as_dict()
    other = {**spec, "view": {"kind": "neighbours", "neighbours": 4}}
    for name, metadata, reason in (
        ("no_spec.onnx", {"spec": {}}, "its Spec has no proper 'network'"),
        ("other.onnx", {"spec": other}, "its network takes other inputs than its Spec names"),
        ("text.onnx", None, ""),
        ("none.onnx", None, "there is no such file"),
    ):
        if metadata is not None:
            proto = onnx.load(KEPT)
            (tmp_path / name).write_bytes(with_metadata(proto, metadata))
        done = derain_onnx(tmp_path / name, tmp_path / "out", tmp_path / "scan.bin")
        assert done.returncode == 2
        assert done.stderr.startswith(f"derain_onnx: {tmp_path / name}: {reason}")
        assert not list(tmp_path.glob("out/*"))


def test_a_scan_is_never_overwritten(derain_onnx, tmp_path) -> None:
    scene(50).tofile(tmp_path / "scan.bin")
    done = derain_onnx(default_model(), tmp_path, tmp_path / "scan.bin")
    assert done.returncode == 2
    assert "it would be overwritten" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["scan.bin"]


def test_two_scans_of_one_name_are_refused_before_one_takes_the_place_of_the_other(
    derain_onnx, tmp_path
) -> None:
    scans = [tmp_path / folder / "scan.bin" for folder in "ab"]
    for scan in scans:
        scan.parent.mkdir()
        scene(50).tofile(scan)
    done = derain_onnx(default_model(), tmp_path / "out", *scans)
    assert done.returncode == 2
    assert f"{scans[1]}: another scan has its name" in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("threads", ["-1", "two", "1000000"])
def test_a_number_of_threads_that_none_could_want_is_refused(
    derain_onnx, tmp_path, threads
) -> None:
    done = derain_onnx("--threads", threads, default_model(), tmp_path, tmp_path / "scan.bin")
    assert done.returncode == 2
    assert f"--threads: '{threads}'" in done.stderr


def test_a_folder_is_no_scan(derain_onnx, tmp_path) -> None:
    done = derain_onnx(default_model(), tmp_path / "out", tmp_path)
    assert done.returncode == 2
    assert f"{tmp_path}: it cannot be read" in done.stderr
