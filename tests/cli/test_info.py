"""``derain info`` prints what is in a scan, labels, a model and a checkpoint."""

import json
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer
from derain.files import read_scan
from derain.files.labels import write_labels
from derain.models.checkpoint import save_model
from derain.views.grid_fit import fit_grid
from derain.views.spherical_grid import grid_of


@pytest.fixture
def scan(tmp_path) -> Path:
    """Six rows: four points at three positions, one row of NaN and one at the origin."""
    rows = np.array(
        [
            [3, 0, 4, 0],
            [0, 2, 0, 10],
            [0, 2, 0, 20],
            [-1, 0, 0, 30],
            [np.nan, 1, 1, 1],
            [0, 0, 0, 99],
        ],
        np.float32,
    )
    path = tmp_path / "scan.bin"
    rows.tofile(path)
    return path


def test_one_grid_is_fitted_to_all_scans_and_can_be_configured(succeed, facts_of, tmp_path) -> None:
    paths = [tmp_path / f"{seed}.bin" for seed in range(2)]
    for seed, path in enumerate(paths):
        scene(2000, seed).tofile(path)
    fit = fit_grid([read_scan(path) for path in paths])
    printed = yaml.safe_load(succeed("info", "--grid", *paths).out)
    assert grid_of(printed["grid"], "info") == fit.grid
    assert facts_of("--grid", *paths) == facts_of("--grid", tmp_path) == printed


def test_a_scan_is_described_by_its_valid_points(facts_of, scan) -> None:
    facts = facts_of(scan)
    fit = fit_grid([read_scan(scan)]).as_dict()
    assert facts.pop("fitted grid") == {name: fit[name] for name in fit if name != "grid"}
    assert facts == {
        "file": str(scan),
        "points": 6,
        "valid": 4,
        "distinct positions": 3,
        "organised": "no",
        "fields": dict.fromkeys(["x", "y", "z", "intensity"], "float32"),
        "x / m": {"min": -1.0, "median": 0.0, "max": 3.0},
        "y / m": {"min": 0.0, "median": 1.0, "max": 2.0},
        "z / m": {"min": 0.0, "median": 0.0, "max": 4.0},
        "range / m": {"min": 1.0, "median": 2.0, "max": 5.0},
        "azimuth / deg": {"min": 0.0, "median": 90.0, "max": 180.0},
        "inclination / deg": {"min": 0.0, "median": 0.0, "max": 53.1301},
        "intensity": {"min": 0.0, "median": 15.0, "max": 30.0},
    }


def test_labels_are_counted_by_class(succeed, facts_of, tmp_path) -> None:
    path = tmp_path / "scan.label"
    write_labels(path, np.array([110, 0, 110, 40]), np.array([7, 0, 8, 0]))
    facts = facts_of(path)
    assert facts["points"] == 4
    assert facts["points by class id"] == {"0": 1, "40": 1, "110": 2}
    lines = succeed("info", path).out.splitlines()
    assert lines[0] == str(path)
    assert "  points by class id: 0 1, 40 1, 110 2" in lines


def test_a_model_holds_its_spec_proof_and_versions(succeed, facts_of, onnx_model) -> None:
    assert facts_of(onnx_model) == {"file": str(onnx_model), **Derainer(onnx_model).metadata}
    text = succeed("info", onnx_model).out
    for fact in ("network: outdet", "data: WADS", "licence: CC BY-NC-SA 4.0", "flipped: 0"):
        assert fact in text


def test_scans_of_a_training_are_counted_in_the_text_and_named_in_json(
    succeed, facts_of, random_outdet, tmp_path
) -> None:
    model, path = deepcopy(random_outdet), tmp_path / "model.ckpt"
    training = {"sequences": [f"{n:04}" for n in range(2000)]}
    model.adopt(replace(model.spec, training=training))
    save_model(model, path)
    lines = succeed("info", path).out.splitlines()
    assert "    training: sequences 2,000" in lines
    assert "  parameters: 11019" in lines
    facts = facts_of(path)
    assert facts["spec"] == model.spec.as_dict()
    assert facts["parameters"] == sum(p.numel() for p in model.parameters())


def test_a_file_that_cannot_be_read_keeps_no_other_from_being_described(
    run_derain, scan, tmp_path
) -> None:
    (tmp_path / "cut.bin").write_bytes(b"12345")
    outcome = run_derain("info", "--json", "none.bin", scan, tmp_path / "cut.bin", scan)
    assert outcome.code == 2
    assert [json.loads(line)["file"] for line in outcome.out.splitlines()] == [str(scan)] * 2
    assert [line.split(": ")[1] for line in outcome.err.splitlines()] == [
        "none.bin",
        str(tmp_path / "cut.bin"),
    ]


def test_a_scan_without_a_valid_point_has_no_grid(facts_of, refused, tmp_path) -> None:
    np.full((10, 4), np.nan, np.float32).tofile(tmp_path / "nothing.bin")
    assert facts_of(tmp_path / "nothing.bin")["fitted grid"] == "none"
    line = refused("info", "--grid", tmp_path / "nothing.bin")
    assert line.startswith("derain: grid: there is no valid point to fit it to.")


@pytest.mark.parametrize(
    ("filled", "span"),
    # More than any sensor measures, so that no intensity counts; the number is still printed.
    [([np.nan], "none"), ([np.inf, 3e7], {"min": 3e7, "median": 3e7, "max": 3e7})],
)
def test_intensities_that_are_no_numbers_are_not_in_the_span(
    facts_of, tmp_path, filled, span
) -> None:
    points = scene(200)
    points[:, 3] = np.resize(filled, 200)
    points.tofile(tmp_path / "scan.bin")
    facts = facts_of(tmp_path / "scan.bin")
    assert (facts["valid"], facts["intensity"]) == (200, span)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("weights.pt", "holds weights without the Spec"),
        ("cut.label", "is not whole labels of 4 bytes"),
    ],
)
def test_what_cannot_be_described_is_refused(refused, tmp_path, name, reason) -> None:
    (tmp_path / name).write_bytes(b"12345")
    assert reason in refused("info", tmp_path / name)
