"""The example in C++ sees what derain sees; with onnxruntime's headers, it judges so as well."""

import json
import os
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from numpy.typing import NDArray

from derain.default import default_model
from derain.evaluation.hard_cases import scene
from derain.export.runtime import METADATA_KEY, Derainer
from derain.scan import Scan
from derain.spec import Spec
from derain.views.candidates import Bound, Candidates
from derain.views.neighbours import Neighbourhoods

from .hard_points import hard_scans

REPOSITORY = Path(__file__).resolve().parents[2]
KEPT = REPOSITORY / "tests" / "export" / "kept" / "outdet.onnx"
SCANS = hard_scans()
CANDIDATES = Candidates(
    (Bound("range", least=2.0, most=9.0), Bound("intensity", most=99.0), Bound("z", least=-1.5))
)

Program = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="module")
def built(made_once: Callable[..., Path]) -> Path:
    """The folder in which the example was built, of onnxruntime what ONNXRUNTIME_ROOT has."""
    missing = [tool for tool in ("cmake", "c++", "make") if shutil.which(tool) is None]
    if missing:
        pytest.skip(f"no {' and no '.join(missing)} to build the example with")
    root = os.environ.get("ONNXRUNTIME_ROOT", "")

    def build(folder: Path) -> None:
        source = REPOSITORY / "examples" / "cpp"
        options = [f"-DONNXRUNTIME_ROOT={root}", "-DCMAKE_CXX_FLAGS=-Werror -O1"]
        for command in (["-S", source, "-B", folder, *options], ["--build", folder]):
            subprocess.run(["cmake", *command], check=True, capture_output=True)

    return made_once("examples_cpp", build)


@pytest.fixture(scope="module")
def show_view(built: Path) -> Program:
    return lambda *arguments: _run(built / "show_view", *arguments)


@pytest.fixture(scope="module")
def derain_onnx(built: Path) -> Program:
    program = built / "derain_onnx"
    if not program.exists():
        pytest.skip("no headers of onnxruntime; set ONNXRUNTIME_ROOT to a folder that has them")
    return lambda *arguments: _run(program, *arguments)


def _run(program: Path, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([program, *arguments], capture_output=True, text=True)


@pytest.fixture(scope="module")
def specs() -> dict[str, Spec]:
    """Specs of the neighbour view, by what they ask for."""
    default, outdet = Derainer(threads=1).spec, Derainer(KEPT, threads=1).spec

    def wide(spec: Spec, *channels: str, neighbours: int = 3) -> Spec:
        statistics = tuple(float(place) for place in range(1, len(channels) + 1))
        view = {"kind": "neighbours", "neighbours": neighbours}
        units = ("m",) * len(channels)
        return replace(
            spec, view=view, channels=channels, units=units, mean=statistics, std=statistics
        )

    return {
        "default": default,
        "intensity": outdet,
        "candidates": replace(wide(outdet, "z", "intensity", neighbours=5), candidates=CANDIDATES),
        "other channels": wide(outdet, "doppler", "range", "z"),
        "one neighbour": wide(outdet, "x", neighbours=1),
        "many neighbours": wide(outdet, "x", neighbours=40),
    }


def metadata_at(path: Path, spec: dict[str, Any]) -> Path:
    """Writes what a model would say of itself."""
    proof = {"points": 1, "rain_iou": float("nan"), "cases": [{"name": 'a "hard" ünë\n'}]}
    path.write_text(json.dumps({"proof": proof, "empty": [{}, []], "spec": spec}))
    return path


def same_view(folder: Path, view: Neighbourhoods) -> None:
    expected = {**view.inputs(), "first": view.first, "inverse": view.inverse}
    assert {path.name for path in folder.iterdir()} == set(expected)
    for name, array in expected.items():
        found = np.fromfile(folder / name, array.dtype)
        np.testing.assert_array_equal(found, array.ravel(), err_msg=name)


@pytest.mark.parametrize("points", SCANS.values(), ids=SCANS)
@pytest.mark.parametrize(
    "name",
    ["default", "intensity", "candidates", "other channels", "one neighbour", "many neighbours"],
)
def test_a_network_would_be_given_the_same_bit_for_bit(
    show_view: Program,
    specs: dict[str, Spec],
    tmp_path: Path,
    name: str,
    points: NDArray[np.float32],
) -> None:
    points.tofile(tmp_path / "scan.bin")
    metadata = metadata_at(tmp_path / "metadata.json", specs[name].as_dict())
    done = show_view(metadata, tmp_path / "scan.bin", tmp_path / "view")
    assert (done.returncode, done.stderr) == (0, "")
    view = specs[name].make_view(threads=1)(Scan.of(points))
    assert isinstance(view, Neighbourhoods)
    same_view(tmp_path / "view", view)


def test_and_so_it_is_for_a_real_scan(
    show_view: Program, specs: dict[str, Spec], shared: Path, tmp_path: Path
) -> None:
    scan = shared / "data" / "wads" / "sample.bin"
    metadata = metadata_at(tmp_path / "metadata.json", specs["intensity"].as_dict())
    assert show_view(metadata, scan, tmp_path / "view").returncode == 0
    points = np.fromfile(scan, np.float32).reshape(-1, 4)
    view = specs["intensity"].make_view()(Scan.of(points))
    assert isinstance(view, Neighbourhoods)
    same_view(tmp_path / "view", view)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"schema": 2}, "its Spec is of a newer layout than this program reads"),
        ({"view": {"kind": "range"}}, "its view is 'range', and this program knows 'neighbours'"),
        ({"view": {"kind": "neighbours", "neighbours": 1e9}}, "its neighbourhoods are of no"),
        ({"channels": ["x"]}, "its channels and their means differ in number"),
        ({"channels": ["x", "y", "dual_return"]}, "it sees the channel 'dual_return'"),
        ({"network": None}, "its Spec has no proper 'network'"),
    ],
)
def test_a_model_that_it_does_not_know_is_refused(
    show_view: Program,
    specs: dict[str, Spec],
    tmp_path: Path,
    change: dict[str, Any],
    reason: str,
) -> None:
    scene(50).tofile(tmp_path / "scan.bin")
    changed = {**specs["default"].as_dict(), **change}
    metadata = metadata_at(tmp_path / "metadata.json", changed)
    done = show_view(metadata, tmp_path / "scan.bin", tmp_path / "view")
    assert done.returncode == 2
    assert done.stderr.startswith(f"show_view: {metadata}: {reason}")
    assert not (tmp_path / "view").exists()


@pytest.mark.parametrize("text", ["", "{", '{"spec": {}} more', '{"spec": [1, 2', "[" * 10_000])
def test_what_is_no_metadata_is_refused(show_view: Program, tmp_path: Path, text: str) -> None:
    scene(50).tofile(tmp_path / "scan.bin")
    (tmp_path / "metadata.json").write_text(text)
    done = show_view(tmp_path / "metadata.json", tmp_path / "scan.bin", tmp_path / "view")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)


def test_a_file_that_is_not_whole_rows_is_refused(
    show_view: Program, specs: dict[str, Spec], tmp_path: Path
) -> None:
    metadata = metadata_at(tmp_path / "metadata.json", specs["default"].as_dict())
    (tmp_path / "scan.bin").write_bytes(bytes(40))
    for scan, reason in (("scan.bin", "40 bytes are not whole rows"), ("none", "cannot be read")):
        done = show_view(metadata, tmp_path / scan, tmp_path / "view")
        assert done.returncode == 2
        assert reason in done.stderr


@pytest.mark.parametrize("model", [default_model(), KEPT], ids=["default", "outdet"])
def test_it_calls_rain_what_derain_calls_rain(
    derain_onnx: Program, tmp_path: Path, model: Path
) -> None:
    scans = {**SCANS, "scene": scene()}
    paths = [tmp_path / f"{number}.bin" for number in range(len(scans))]
    for path, points in zip(paths, scans.values(), strict=True):
        points.tofile(path)
    done = derain_onnx(model, tmp_path / "out", *paths)
    assert (done.returncode, done.stderr) == (0, "")
    derainer = Derainer(model, threads=1)
    for path, points in zip(paths, scans.values(), strict=True):
        rain = derainer(points)
        label = np.fromfile(tmp_path / "out" / f"{path.stem}.label", "<u4")
        np.testing.assert_array_equal(label, rain)
        assert (tmp_path / "out" / path.name).read_bytes() == points[~rain].tobytes()
        assert f"{path}: {len(points)} points, {rain.sum()} rain" in done.stdout


def test_it_judges_candidates_as_well(
    derain_onnx: Program, judging_candidates: Path, tmp_path: Path
) -> None:
    derainer = Derainer(judging_candidates, threads=1)
    points = SCANS["ties, copies, invalid rows"]
    points.tofile(tmp_path / "scan.bin")
    assert derain_onnx(judging_candidates, tmp_path / "out", tmp_path / "scan.bin").returncode == 0
    label = np.fromfile(tmp_path / "out" / "scan.label", "<u4")
    np.testing.assert_array_equal(label, derainer(points))
    assert 0 < label.sum() < len(label)


def test_a_file_that_is_no_model_of_derain_is_refused(derain_onnx: Program, tmp_path: Path) -> None:
    scene(50).tofile(tmp_path / "scan.bin")
    (tmp_path / "text.onnx").write_text("no model")
    spec = Derainer(KEPT).spec.as_dict()
    other = {**spec, "view": {"kind": "neighbours", "neighbours": 4}}
    for name, metadata, reason in (
        ("no_spec.onnx", {"spec": {}}, "its Spec has no proper 'network'"),
        ("other.onnx", {"spec": other}, "its network takes other inputs than its Spec says"),
        ("text.onnx", None, ""),
        ("none.onnx", None, "there is no such file"),
    ):
        if metadata is not None:
            proto = onnx.load(KEPT)
            onnx.helper.set_model_props(proto, {METADATA_KEY: json.dumps(metadata)})
            onnx.save(proto, tmp_path / name)
        done = derain_onnx(tmp_path / name, tmp_path / "out", tmp_path / "scan.bin")
        assert done.returncode == 2
        assert done.stderr.startswith(f"derain_onnx: {tmp_path / name}: {reason}")
        assert not list(tmp_path.glob("out/*"))


def test_a_scan_is_never_overwritten(derain_onnx: Program, tmp_path: Path) -> None:
    scene(50).tofile(tmp_path / "scan.bin")
    done = derain_onnx(default_model(), tmp_path, tmp_path / "scan.bin")
    assert done.returncode == 2
    assert "it would be overwritten" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["scan.bin"]


def test_the_metadata_that_show_view_takes_is_that_of_a_model(
    show_view: Program, tmp_path: Path
) -> None:
    import onnxruntime

    session = onnxruntime.InferenceSession(default_model(), providers=["CPUExecutionProvider"])
    metadata, scan = tmp_path / "metadata.json", tmp_path / "scan.bin"
    metadata.write_text(session.get_modelmeta().custom_metadata_map[METADATA_KEY])
    scene(100).tofile(scan)
    assert show_view(metadata, scan, tmp_path / "view").returncode == 0
