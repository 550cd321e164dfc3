"""A bench from Python: methods of every kind, on scans in memory and in files."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from derain.errors import InputError
from derain.evaluation.baselines import all_points
from derain.evaluation.counts import Counts
from derain.evaluation.scores import score
from derain.export.bench import bench as module
from derain.export.bench.bench import bench, scored_methods
from derain.export.bench.bench_entries import bench_entries
from derain.export.bench.cost import measure_in_process
from derain.export.bench.labelled_frames import LabelledFrames
from derain.export.methods import load_method
from derain.export.runtime import Derainer
from derain.filters import DSOR, FILTERS, FilterDerainer
from derain.scan import Scan
from derain.views.neighbours import NeighbourView


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Times methods in this process; that each has its own is tested by itself."""
    monkeypatch.setattr(module, "measure_cost", measure_in_process)


@pytest.mark.usefixtures("here")
def test_scans_in_memory_score_as_the_same_scans_in_files(labelled: LabelledFrames) -> None:
    methods = ["dsor", "position", "intensity", "all"]
    files = [frame.path for frame in labelled.frames]
    scans = [labelled.read(frame) for frame in labelled.frames]
    rates = labelled.rain_rates
    of_files = bench(methods, files, labelled.card, train=files, rain_rates=rates, repeats=1)
    of_scans = bench(methods, scans, labelled.card, train=scans, repeats=1)
    for in_files, in_memory in zip(of_files.rows, of_scans.rows, strict=True):
        assert list(in_files.scores.by_rain_rate) == ["10 mm/h", "25 mm/h"]
        assert in_memory.scores == replace(in_files.scores, by_rain_rate={})
        assert in_memory.iou_interval == in_files.iou_interval
    assert [file["scan"] for file in of_scans.facts["files"]] == [str(file) for file in files]


@pytest.mark.usefixtures("here")
def test_methods_are_names_derainers_filters_and_functions(
    labelled: LabelledFrames, onnx_model: Path
) -> None:
    derainer = Derainer(onnx_model, 1)
    derainer.spec = replace(derainer.spec, threshold=0.4)
    methods = {
        "name": "dsor",
        "filter": DSOR(),
        "filter, ready": FilterDerainer(DSOR(), 1),
        "file": onnx_model,
        "model": derainer,
        "function": all_points,
        "call": FilterDerainer(DSOR(), 1).__call__,
    }
    found = bench(methods, labelled.frames, labelled.card, timed=1, repeats=1)
    assert [row.title for row in found.rows] == list(methods)
    pooled = {row.title: row.scores.pooled for row in found.rows}
    assert pooled["name"] == pooled["filter"] == pooled["filter, ready"] == pooled["call"]
    assert pooled["function"] == Counts(90, 790, 0, 0)
    assert [found[title].kind for title in ("filter", "file", "function")] == [
        "dsor",
        "outdet",
        "function",
    ]
    assert found["model"].as_dict()["threshold"] == 0.4
    scans = [labelled.read(frame) for frame in labelled.frames]
    expected = Counts()
    for scan in scans:
        known = scan.label != 9
        expected += Counts.of(derainer(scan)[known], (scan.label == 3)[known])
    assert pooled["model"] == expected
    untitled = bench([DSOR(), derainer, all_points], scans, labelled.card, timed=1, repeats=1)
    assert [row.title for row in untitled.rows] == ["dsor", onnx_model.stem, "all_points"]


def test_what_only_this_program_knows_is_timed_in_its_process_and_told(
    labelled: LabelledFrames, tmp_path: Path
) -> None:
    found = bench(
        {"mine": lambda scan: scan.intensity < 4, "all": "all"},
        labelled.frames,
        labelled.card,
        timed=1,
        repeats=1,
    )
    mine, everything = found.rows
    assert (mine.cost.alone, everything.cost.alone) == (False, True)
    assert mine.cost.peak_memory is None
    assert mine.milliseconds > 0 < everything.milliseconds
    found.write(tmp_path / "out")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        *("bench.md", "bench.csv", "bench.json"),
        "speed_error.png",
    }
    rows = json.loads((tmp_path / "out/bench.json").read_text())["rows"]
    assert [row.get("timed_alone", True) for row in rows] == [False, True]
    text = (tmp_path / "out/bench.md").read_text()
    (line,) = [line for line in text.splitlines() if line.startswith("Timed in the process")]
    assert line.endswith("of their own: mine.")
    assert str(found) in text
    assert "derain.bench(['mine', 'all'], ...)" in text


SCRIPT = """
import numpy as np
from derain.export.bench.bench import bench
from derain.scan import Scan

print("begins")
points = np.random.default_rng(0).uniform(-9, 9, (200, 4))
scan = Scan.of(points).with_label(np.where(points[:, 3] < 0, 110, 40))

def dim(scan):
    return scan.intensity < 0

found = bench([dim, "all"], [scan], "wads", repeats=1)
for row in found.rows:
    print(row.title, row.scores.pooled.iou == 1, row.cost.alone, row.cost.failure)
"""


def test_a_script_that_guards_nothing_is_run_once(tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text(SCRIPT)
    finished = subprocess.run(
        [sys.executable, str(tmp_path / "script.py")], capture_output=True, text=True
    )
    assert finished.returncode == 0, finished.stderr
    assert finished.stdout.splitlines() == ["begins", "dim True False None", "all False True None"]


@pytest.mark.parametrize(
    "answer", [lambda n: np.ones(n + 1, bool), lambda n: np.ones(n), lambda n: None]
)
def test_a_function_that_gives_no_mask_is_told_in_its_row(labelled: LabelledFrames, answer) -> None:
    found = bench({"odd": lambda scan: answer(len(scan))}, labelled.frames, labelled.card, timed=1)
    (row,) = found.rows
    assert len(row.scores.failures) == 3
    assert "Let it return a bool array" in row.cost.failure
    assert all("Let it return a bool array" in why for why in row.scores.failures.values())


def test_what_cannot_be_benched_is_refused(labelled: LabelledFrames, tmp_path: Path) -> None:
    (scan, *_) = (labelled.read(frame) for frame in labelled.frames)
    card = labelled.card
    with pytest.raises(InputError, match="methods: there are none"):
        bench([], [scan], card)
    with pytest.raises(InputError, match="methods: the class DSOR is no method"):
        bench([DSOR], [scan], card)  # type: ignore[list-item]
    with pytest.raises(InputError, match="methods: int is no method"):
        bench([3], [scan], card)  # type: ignore[list-item]
    with pytest.raises(InputError, match="scans: there are none"):
        bench(["all"], [], card)
    with pytest.raises(InputError, match="scans: int is no scan"):
        bench(["all"], [3], card)  # type: ignore[list-item]
    with pytest.raises(InputError, match="it has no labels"):
        bench(["all"], [Scan(scan.xyz)], card)
    labelled.frames[0].label_path.unlink()
    with pytest.raises(InputError, match="its labels are not at"):
        bench(["all"], labelled.frames, card)


def test_a_loaded_model_of_another_threshold_is_made_anew_in_its_process(
    labelled: LabelledFrames, onnx_model: Path
) -> None:
    derainer = load_method(str(onnx_model), {"threshold": 0.25}, 1)
    found = bench([derainer], labelled.frames, labelled.card, timed=1, repeats=1)
    (row,) = found.rows
    assert row.cost.alone
    assert row.cost.failure is None
    assert row.as_dict()["threshold"] == 0.25


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(("rain", "warned"), [((3,), False), ((9,), True), ((), False)])
def test_a_bench_without_rain_warns_unless_its_data_are_clean(
    labelled: LabelledFrames,
    capsys: pytest.CaptureFixture[str],
    rain: tuple[int, ...],
    warned: bool,
) -> None:
    frames, card = labelled.frames[1:], replace(labelled.card, rain=rain, unknown=())
    found = bench(["none"], frames, card, timed=1, repeats=1)
    name = labelled.card.classes[9]
    assert (f"no point of these scans is {name}" in capsys.readouterr().err) == warned
    assert found["none"].scores.pooled.false_positive == 0


def test_filters_share_one_search_and_score_as_they_would_alone(
    labelled: LabelledFrames, monkeypatch: pytest.MonkeyPatch
) -> None:
    searches = []
    view = NeighbourView.__call__

    def counted(self: NeighbourView, scan: Scan) -> object:
        searches.append(self.neighbours)
        return view(self, scan)

    rows = bench_entries(list(FILTERS))
    monkeypatch.setattr(NeighbourView, "__call__", counted)
    scans = list(map(labelled.read, labelled.frames))
    together = score(scored_methods(rows, threads=1), scans, labelled.card)
    assert searches == [9, 9, 9]  # SSR looks at the most
    monkeypatch.undo()
    alone = [FilterDerainer(row.filter, threads=1) for row in rows]
    assert together == score(alone, scans, labelled.card)
