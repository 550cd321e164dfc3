"""Methods by the names that users give them."""

from pathlib import Path

import numpy as np
import onnx
import pytest
import yaml

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export.bench.bench_entries import FILE_SIZE, bench_entries
from derain.export.runtime import Derainer
from derain.filters import DSOR
from derain.scan import Scan
from derain.system.stopwatch import Stopwatch


def parameters(path: Path, **content: object) -> str:
    path.write_text(yaml.safe_dump(content))
    return str(path)


def test_a_row_is_called_by_its_title_else_by_its_name(onnx_model: Path, tmp_path: Path) -> None:
    tuned = parameters(tmp_path / "best.yaml", method="dsor", range_multiplier=0.08)
    odd = parameters(tmp_path / "r=0.1.yaml", method="dsor", range_multiplier=0.1)
    names = [str(onnx_model), f"fine={onnx_model}", "dror", tuned, "none", odd, f"other={odd}"]
    rows = bench_entries(names)
    assert [(row.title, row.kind) for row in rows] == [
        ("outdet", "outdet"),
        ("fine", "outdet"),
        ("dror", "dror"),
        ("best", "dsor"),
        ("none", "none"),
        ("r=0.1", "dsor"),
        ("other", "dsor"),
    ]
    assert rows[3].filter == DSOR(range_multiplier=0.08)


def test_a_file_of_parameters_gives_a_model_its_threshold(onnx_model: Path, tmp_path: Path) -> None:
    file = parameters(tmp_path / "low.yaml", method=str(onnx_model), threshold=0.25)
    (row,) = bench_entries([file])
    scan = Scan.of(scene(300))
    probability = Derainer(onnx_model, 1).probability(scan)
    np.testing.assert_array_equal(row.ready(1)(scan, Stopwatch()), probability > 0.25)
    assert row.facts["threshold"] == 0.25


def test_the_weights_are_those_of_the_network(random_outdet, onnx_model: Path) -> None:
    (row,) = bench_entries([str(onnx_model)])
    # Two convolutions of 9 neighbours, 4 channels and a distance to 32 and 32 to 32, their biases,
    # the shortcut past them, and the head: the norms are folded into them.
    folded = 9 * (4 + 1) * 32 + 32 + 9 * 32 * 32 + 32 + 4 * 32 + 32 * 2 + 2
    assert sum(tensor.numel() for tensor in random_outdet.deployed().parameters()) == folded
    # The exporter adds the numbers that shapes and indices are made of.
    graph = onnx.load(onnx_model).graph
    tensors = [onnx.numpy_helper.to_array(tensor) for tensor in graph.initializer]
    numbers = sum(tensor.size for tensor in tensors if tensor.dtype == np.int64)
    assert row.facts["weights"] == folded + numbers
    assert row.facts[FILE_SIZE] == len(onnx_model.read_bytes())


def test_baselines_learn_from_the_scans_that_are_given() -> None:
    scan = Scan.of(scene(300))
    rain = np.arange(300) >= 270
    position, intensity = bench_entries(["position", "intensity"], lambda: iter([(scan, rain)]))
    for row in (position, intensity):
        called = row.ready(1)(scan, Stopwatch())
        assert np.count_nonzero(called & rain) / np.count_nonzero(called | rain) > 0.5


@pytest.mark.parametrize(
    ("names", "reason"),
    [
        (["nothing"], "nothing: no such file"),
        (["absent.onnx"], "absent.onnx: no such file"),
        (["position"], "position: it has no scans to learn from. Give --train"),
        (["dror", "dror"], "dror: it is the title of two methods"),
        (["x=dror", "x=none"], "x: it is the title of two methods"),
    ],
)
def test_a_method_that_cannot_be_used_is_refused(names: list[str], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        bench_entries(names)
