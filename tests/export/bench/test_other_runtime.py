"""A model by another runtime stands beside itself, with what that changes."""

import re
from pathlib import Path

import numpy as np
import pytest

from derain.errors import InputError
from derain.export.bench import bench as bench_module
from derain.export.bench.bench import bench
from derain.export.bench.bench_entries import bench_entries
from derain.export.bench.cost import measure_in_process
from derain.export.bench.labelled_frames import LabelledFrames
from derain.export.runtime import Derainer
from derain.export.runtimes.registry import Runtime

KEPT = Path(__file__).parent.parent / "kept/outdet.onnx"

pytestmark = pytest.mark.usefixtures("rainy")


@pytest.fixture(autouse=True)
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Times methods in this process, where there is the runtime of these tests."""
    monkeypatch.setattr(bench_module, "measure_cost", measure_in_process)


def test_every_model_is_followed_by_itself_by_the_other_runtime(tmp_path: Path) -> None:
    low = tmp_path / "low.yaml"
    low.write_text(f"method: {KEPT}\nthreshold: 0.25\n")
    rows = bench_entries([f"a={KEPT}", "dror", str(low)], runtime=Runtime("rainy", "bf16"))
    assert [row.title for row in rows] == [
        *("a", "a (rainy bf16)", "dror", "low", "low (rainy bf16)")
    ]
    assert [row.facts.get("runtime") for row in rows] == [
        *(None, "rainy bf16", None, None, "rainy bf16")
    ]
    assert [row.facts.get("threshold") for row in rows] == [0.5, 0.5, None, 0.25, 0.25]
    assert rows[4].ready(1).runtime == Runtime("rainy", "bf16")
    assert rows[4].usual(1).runtime == Runtime()
    assert rows[4].ready(1).spec.threshold == 0.25


def test_without_another_runtime_nothing_is_added() -> None:
    (row,) = bench_entries([str(KEPT)])
    assert row.usual is None
    assert "runtime" not in row.facts


def test_a_runtime_with_nothing_to_run_is_refused() -> None:
    with pytest.raises(InputError, match="runtime rainy: none of the methods is a model"):
        bench_entries(["dror", "all"], runtime=Runtime("rainy"))


def test_what_it_changes_is_counted(labelled: LabelledFrames, tmp_path: Path) -> None:
    scans = [frame.path for frame in labelled.frames]
    options = {"threads": 1, "timed": 2, "repeats": 1, "runtime": "rainy"}
    found = bench([str(KEPT), "all"], scans, labelled.card, precision="int2", **options)
    assert [row.title for row in found.rows] == ["outdet", "outdet (rainy int2)", "all"]
    # All is rain to it, so that it flips what onnxruntime does not call rain.
    assert found["outdet (rainy int2)"].scores.pooled == found["all"].scores.pooled
    (change,) = found.facts["runtimes"]
    usual = Derainer(KEPT, 1)
    rain = np.concatenate([usual(labelled.read(labelled.frames[row])) for row in (0, 2)])
    assert change["method"] == "outdet (rainy int2)"
    assert change["scans"] == 2
    assert change["points"] == len(rain)
    assert change["flipped"] == (~rain).sum()
    assert change["rain_iou"] == pytest.approx(rain.mean())
    found.write(tmp_path)
    text = (tmp_path / "bench.md").read_text()
    assert "## What another runtime changes" in text
    row = rf"outdet \(rainy int2\) +\| +2 scans, {len(rain)} points .*\| +{change['flipped']} \|"
    assert re.search(row, text)
    assert re.search(row, str(found))


def test_a_model_that_has_its_runtime_is_compared_as_well(labelled: LabelledFrames) -> None:
    scans = [frame.path for frame in labelled.frames]
    model = Derainer(KEPT, 1, "rainy", "bf16")
    found = bench({"mine": model}, scans, labelled.card, threads=1, timed=1, repeats=1)
    (change,) = found.facts["runtimes"]
    assert (change["method"], change["runtime"]) == ("mine", "rainy bf16")
    assert 0 < change["largest_difference"] <= 0.0101


def test_what_fails_is_told(labelled: LabelledFrames, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*_: object) -> None:
        raise MemoryError("no room")

    scans = [frame.path for frame in labelled.frames]
    rows = bench_entries([str(KEPT)], runtime=Runtime("rainy"))
    assert len(rows) == 2
    monkeypatch.setattr("derain.export.proof.compare_runtimes", failing)
    found = bench([str(KEPT)], scans, labelled.card, threads=1, timed=1, repeats=1, runtime="rainy")
    assert found.facts["runtimes"] == [
        {"method": "outdet (rainy)", "runtime": "rainy", "failure": "no room"}
    ]
    assert "no room" in str(found)
