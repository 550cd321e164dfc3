"""The example in C++ sees what derain sees."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
import pytest

from derain.default import default_model
from derain.evaluation.hard_cases import scene
from derain.export.runtime import METADATA_KEY, Derainer
from derain.scan import Scan
from derain.spec import Spec
from derain.views.candidates import Bound, Candidates
from derain.views.isolated_points import IsolatedPoints
from derain.views.neighbours import Neighbourhoods
from derain.views.range_image import RangeImage
from derain.views.view import ViewedScan

from .hard_points import KEPT, SCANS

CANDIDATES = Candidates(
    (Bound("range", least=2.0, most=9.0), Bound("intensity", most=99.0), Bound("z", least=-1.5))
)

GRID = {"columns": 8, "azimuth": [-180, 180], "edges": [9, 0, -9]}
IMAGE = {"kind": "range", "grid": GRID, "way_back": "copy"}


@pytest.fixture(scope="module")
def specs() -> dict[str, Spec]:
    """Specs by what they ask for."""
    default, outdet = Derainer(threads=1).spec, Derainer(KEPT, threads=1).spec

    def wide(spec: Spec, *channels: str, neighbours: int = 3) -> Spec:
        statistics = tuple(float(place) for place in range(1, len(channels) + 1))
        view = {"kind": "neighbours", "neighbours": neighbours}
        units = ("m",) * len(channels)
        return replace(
            spec, view=view, channels=channels, units=units, mean=statistics, std=statistics
        )

    edges = np.linspace(25.0, -25.0, 19).tolist()

    def image(right: float, left: float) -> Spec:
        grid = {"columns": 61, "azimuth": [right, left], "edges": edges}
        channels = wide(outdet, "intensity", "range", "doppler")
        return replace(channels, view={**IMAGE, "grid": grid})

    return {
        "circle": image(-180.0, 180.0),
        "sector": image(-20.0, 190.0),
        "isolated points": replace(
            wide(outdet, "x", "y", "z"), view={"kind": "isolated_points", "neighbours": 9}
        ),
        "default": default,
        "intensity": outdet,
        "candidates": replace(wide(outdet, "z", "intensity", neighbours=5), candidates=CANDIDATES),
        "other channels": wide(outdet, "doppler", "range", "z"),
        "one neighbour": wide(outdet, "x", neighbours=1),
        "many neighbours": wide(outdet, "x", neighbours=40),
    }


def metadata_at(path: Path, spec: dict[str, Any]) -> Path:
    """Writes the metadata of a model."""
    proof = {"points": 1, "rain_iou": float("nan"), "cases": [{"name": 'a "hard" ünë\n'}]}
    path.write_text(json.dumps({"proof": proof, "empty": [{}, []], "spec": spec}))
    return path


def same_view(folder: Path, view: ViewedScan) -> None:
    if isinstance(view, RangeImage):
        way_back = {"pixel": view.pixel, "winner": view.winner}
    else:
        assert isinstance(view, Neighbourhoods | IsolatedPoints)
        way_back = {"first": view.first, "inverse": view.inverse}
    expected = {**view.inputs(), **way_back}
    assert {path.name for path in folder.iterdir()} == set(expected)
    for name, array in expected.items():
        found = np.fromfile(folder / name, array.dtype)
        np.testing.assert_array_equal(found, array.ravel(), err_msg=name)


@pytest.mark.parametrize("points", SCANS.values(), ids=SCANS)
def test_a_network_would_be_given_the_same_bit_for_bit(show_view, specs, tmp_path, points) -> None:
    points.tofile(tmp_path / "scan.bin")
    for name, spec in specs.items():
        metadata = metadata_at(tmp_path / "metadata.json", spec.as_dict())
        done = show_view(metadata, tmp_path / "scan.bin", tmp_path / name)
        assert (done.returncode, done.stderr) == (0, ""), name
        same_view(tmp_path / name, spec.make_view(threads=1)(Scan.of(points)))


@pytest.mark.parametrize("name", ["intensity", "circle"])
def test_and_so_it_is_for_a_real_scan(show_view, specs, shared, tmp_path, name) -> None:
    scan = shared / "data" / "wads" / "sample.bin"
    metadata = metadata_at(tmp_path / "metadata.json", specs[name].as_dict())
    assert show_view(metadata, scan, tmp_path / "view").returncode == 0
    points = np.fromfile(scan, np.float32).reshape(-1, 4)
    same_view(tmp_path / "view", specs[name].make_view()(Scan.of(points)))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"schema": 2}, "its Spec is of a newer layout than this program reads. Run it with"),
        ({"view": {"kind": "voxels"}}, "its view is 'voxels', which this program does not know. R"),
        ({"view": {**IMAGE, "way_back": "crf"}}, "its way_back is 'crf', which this program"),
        ({"view": {**IMAGE, "grid": {**GRID, "columns": 1e9}}}, "its grid is none that there can"),
        ({"view": {**IMAGE, "grid": {**GRID, "edges": [1, 2]}}}, "its grid is none that there can"),
        ({"view": {"kind": "neighbours", "neighbours": 1e9}}, "its neighbourhoods are of no"),
        ({"channels": ["x"]}, "its channels and their means differ in number"),
        ({"network": None}, "its Spec has no proper 'network'"),
    ],
)
def test_a_model_that_it_does_not_know_is_refused(
    show_view, specs, tmp_path, change, reason
) -> None:
    scene(50).tofile(tmp_path / "scan.bin")
    changed = {**specs["default"].as_dict(), **change}
    metadata = metadata_at(tmp_path / "metadata.json", changed)
    done = show_view(metadata, tmp_path / "scan.bin", tmp_path / "view")
    assert done.returncode == 2
    assert done.stderr.startswith(f"show_view: {metadata}: {reason}")
    assert not (tmp_path / "view").exists()


def test_what_is_no_metadata_and_no_scan_is_refused(show_view, tmp_path) -> None:
    metadata, scan = tmp_path / "metadata.json", tmp_path / "scan.bin"
    scene(50).tofile(scan)
    for text in ("", "{", '{"spec": {}} more', '{"spec": [1, 2', "[" * 10_000):
        metadata.write_text(text)
        done = show_view(metadata, scan, tmp_path / "view")
        assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    session = onnxruntime.InferenceSession(default_model(), providers=["CPUExecutionProvider"])
    metadata.write_text(session.get_modelmeta().custom_metadata_map[METADATA_KEY])
    assert show_view(metadata, scan, tmp_path / "view").returncode == 0
    scan.write_bytes(bytes(40))
    for name, reason in ((scan, "40 bytes are not whole rows"), ("none", "cannot be read")):
        done = show_view(metadata, name, tmp_path / "view")
        assert done.returncode == 2
        assert reason in done.stderr
