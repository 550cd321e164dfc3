"""A bench from Python: methods of every kind, on scans in memory and in files."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from derain.errors import InputError
from derain.evaluation.baselines import all_points
from derain.evaluation.counts import Counts
from derain.evaluation.scores import score
from derain.export.bench.bench import bench, scored_methods
from derain.export.bench.bench_entries import FILE_SIZE, bench_entries
from derain.export.methods import load_method
from derain.export.model_file import number_of_weights
from derain.export.runtime import Derainer
from derain.export.runtimes.session import Runtime
from derain.filters import DSOR, FILTERS, FilterDerainer
from derain.scan import Scan
from derain.views.neighbours import NeighbourView

KEPT = Path(__file__).parent.parent / "kept/outdet.onnx"
QUICK = {"threads": 1, "timed": 1, "repeats": 1}


def parameters(path: Path, **content: object) -> str:
    path.write_text(yaml.safe_dump(content))
    return str(path)


def test_a_row_is_called_by_its_title_else_by_its_name(tmp_path) -> None:
    odd = parameters(tmp_path / "r=0.1.yaml", method="dsor", range_multiplier=0.1)
    names = {
        str(KEPT): ("outdet", "outdet"),
        f"fine={KEPT}": ("fine", "outdet"),
        "dror": ("dror", "dror"),
        "none": ("none", "none"),
        odd: ("r=0.1", "dsor"),
        f"other={odd}": ("other", "dsor"),
    }
    rows = bench_entries([*names])
    assert [row.title for row in bench_entries("dror")] == ["dror"]
    assert [(row.title, row.kind) for row in rows] == [*names.values()]
    assert rows[4].filter.filter == DSOR(range_multiplier=0.1)
    assert rows[0].facts["weights"] == number_of_weights(KEPT.read_bytes())
    assert rows[0].facts[FILE_SIZE] == len(KEPT.read_bytes())


@pytest.mark.usefixtures("in_this_process")
def test_methods_are_names_files_derainers_filters_and_functions(labelled, tmp_path) -> None:
    derainer = Derainer(KEPT, 1)
    derainer.spec = replace(derainer.spec, threshold=0.4)
    methods = {
        "name": "dsor",
        "filter": DSOR(),
        "filter, ready": FilterDerainer(DSOR(), 1),
        "path": KEPT,
        "model": derainer,
        "file": parameters(tmp_path / "low.yaml", method=str(KEPT), threshold=0.4),
        "function": all_points,
    }
    found = bench(methods, labelled.frames, labelled.reader.card, **QUICK)
    assert [row.title for row in found.rows] == list(methods)
    pooled = {row.title: row.scores.pooled for row in found.rows}
    assert pooled["name"] == pooled["filter"] == pooled["filter, ready"]
    assert pooled["function"] == Counts(90, 790, 0, 0)
    kinds = [found[title].kind for title in ("filter", "path", "function")]
    assert kinds == ["dsor", "outdet", "function"]
    thresholds = [found[title].as_dict()["threshold"] for title in ("path", "model", "file")]
    assert thresholds == [0.5, 0.4, 0.4]
    scans = [labelled.reader.read(frame) for frame in labelled.frames]
    expected = Counts()
    for scan in scans:
        known = scan.label != 9
        expected += Counts.of(derainer(scan)[known], (scan.label == 3)[known])
    assert pooled["model"] == pooled["file"] == expected != pooled["path"]
    untitled = bench([DSOR(), derainer, all_points], scans, labelled.reader.card, **QUICK)
    assert [row.title for row in untitled.rows] == ["dsor", "outdet", "all_points"]


@pytest.mark.usefixtures("in_this_process")
def test_scans_in_memory_score_as_the_same_scans_in_files(labelled) -> None:
    methods = ["dsor", "position", "intensity"]
    files = [frame.path for frame in labelled.frames]
    scans = [labelled.reader.read(frame) for frame in labelled.frames]
    rates = labelled.rain_rates
    of_files = bench(methods, files, labelled.reader.card, train=files, rain_rates=rates, **QUICK)
    of_scans = bench(methods, scans, labelled.reader.card, train=scans, **QUICK)
    for in_files, in_memory in zip(of_files.rows, of_scans.rows, strict=True):
        assert list(in_files.scores.by_rain_rate) == ["10 mm/h", "25 mm/h"]
        counts = {**in_files.scores.to_json(), "by_rain_rate": []}
        assert in_memory.scores.to_json() == counts
        assert in_memory.iou_interval == in_files.iou_interval
    assert [file["scan"] for file in of_scans.facts["files"]] == [str(file) for file in files]
    for learnt in ("position", "intensity"):
        assert of_files[learnt].scores.pooled.iou > 0.5


SCRIPT = """
import numpy as np
from derain.export.bench.bench import bench
from derain.scan import Scan

print("begins")
points = np.random.default_rng(0).uniform(-9, 9, (200, 4))
scan = Scan.of(points).with_label(np.where(points[:, 3] < 0, 110, 40))

def dim(scan):
    return scan.intensity < 0

methods = {"dim": dim, "same": lambda scan: dim(scan), "all": "all"}
found = bench(methods, [scan], "wads", repeats=1)
for row in found.rows:
    print(row.title, row.scores.pooled.iou == 1, row.cost.peak_memory is None)
    assert row.cost.times.percentile(50) > 0, row.cost.failure
"""


def test_a_script_that_guards_nothing_is_run_once_and_times_its_own_functions(tmp_path) -> None:
    (tmp_path / "script.py").write_text(SCRIPT)
    finished = subprocess.run(
        [sys.executable, str(tmp_path / "script.py")], capture_output=True, text=True
    )
    assert finished.returncode == 0, finished.stderr
    linux = sys.platform == "linux"  # elsewhere no peak of memory is known
    here = ["dim True True", "same True True"]
    assert finished.stdout.splitlines() == ["begins", *here, f"all False {not linux}"]


@pytest.mark.parametrize(
    "answer", [lambda n: np.ones(n + 1, bool), lambda n: np.ones(n), lambda n: None]
)
def test_a_function_that_gives_no_mask_fails_in_every_scan(labelled, answer) -> None:
    (entry,) = bench_entries({"odd": lambda scan: answer(len(scan))})
    scans = map(labelled.reader.read, labelled.frames)
    (scores,) = score(scored_methods([entry], 1), scans, labelled.reader.card)
    assert len(scores.failures) == 3
    assert all("Let it return a bool array" in why for why in scores.failures.values())


@pytest.mark.parametrize(
    ("methods", "reason"),
    [
        ([], "methods: there are none"),
        ([DSOR], "methods: .*DSOR.* is no method"),
        ([3], "methods: 3 is no method"),
        (["position"], "position: it has no scans to learn from. Give --train"),
        (["x=dror", "x=none"], "x: it is the title of two methods"),
    ],
)
def test_a_method_that_cannot_be_used_is_refused(methods, reason) -> None:
    with pytest.raises(InputError, match=reason):
        bench_entries(methods)


def test_scans_that_cannot_be_benched_are_refused(labelled) -> None:
    with pytest.raises(InputError, match="scans: there are none"):
        bench(["all"], [], labelled.reader.card)
    for amount in ({"timed": 0}, {"repeats": 0}):
        with pytest.raises(InputError, match=f"{next(iter(amount))}: 0 is too few"):
            bench(["all"], labelled.frames, labelled.reader.card, **amount)
    labelled.frames[0].label_path.unlink()
    with pytest.raises(InputError, match="its labels are not at"):
        bench(["all"], labelled.frames, labelled.reader.card)


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize(("rain", "warned"), [((3,), False), ((9,), True)])
def test_a_bench_without_rain_warns(labelled, capsys, rain, warned) -> None:
    frames, card = labelled.frames[1:], replace(labelled.reader.card, rain=rain, unknown=())
    bench(["none"], frames, card, **QUICK)
    assert ("no point of these scans is unknown" in capsys.readouterr().err) == warned


def test_filters_share_one_search_and_score_as_they_would_alone(labelled, monkeypatch) -> None:
    searches = []
    view = NeighbourView.__call__

    def counted(self: NeighbourView, scan: Scan) -> object:
        searches.append(self.neighbours)
        return view(self, scan)

    rows = bench_entries(list(FILTERS))
    monkeypatch.setattr(NeighbourView, "__call__", counted)
    scans = list(map(labelled.reader.read, labelled.frames))
    together = score(scored_methods(rows, threads=1), scans, labelled.reader.card)
    assert searches == [9, 9, 9]  # SSR looks at the most
    monkeypatch.undo()
    alone = [FilterDerainer(row.filter.filter, threads=1) for row in rows]
    apart = score(alone, scans, labelled.reader.card)
    assert [each.to_json() for each in together] == [each.to_json() for each in apart]


@pytest.mark.usefixtures("rainy")
def test_every_model_is_followed_by_itself_by_the_other_runtime(tmp_path) -> None:
    low = parameters(tmp_path / "low.yaml", method=str(KEPT), threshold=0.25)
    rows = bench_entries([f"a={KEPT}", "dror", low], runtime=Runtime("rainy", "bf16"))
    titles = ["a", "a (rainy bf16)", "dror", "low", "low (rainy bf16)"]
    assert [row.title for row in rows] == titles
    assert ["runtime" in row.facts for row in rows] == ["rainy" in title for title in titles]
    assert rows[4].facts["threshold"] == 0.25
    assert rows[4].ready(1).runtime == Runtime("rainy", "bf16")
    with pytest.raises(InputError, match="runtime rainy: none of the methods is a model"):
        bench_entries(["dror", "all"], runtime=Runtime("rainy"))


@pytest.mark.usefixtures("rainy", "in_this_process")
def test_a_model_in_another_runtime_is_measured_in_that(labelled) -> None:
    model = load_method(str(KEPT), {}, 1, Runtime("rainy", "int2"))
    methods = {"mine": model, "all": "all"}
    found = bench(methods, labelled.frames, labelled.reader.card, **QUICK)
    assert found["mine"].scores.pooled == found["all"].scores.pooled  # all is rain to it
