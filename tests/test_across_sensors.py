"""The table across sensors holds what counting by hand gives, and names what it leaves out."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from recorded_scenes import write_scenes

from benchmarks.across_sensors import main
from benchmarks.sensor_table.columns import Cell, Column, table
from benchmarks.sensor_table.measure import Measurement, factor_for
from benchmarks.sensor_table.plan import Plan
from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels
from derain.filters import CRF, DROR, FilterDerainer
from derain.scan import Scan

CARD = """\
name: made up
licence: none
rain: [3]
classes: {0: solid, 3: rain, 4: pedestrian}
"""

PLAN = """\
methods:
  nothing: none
  a model that is missing: missing.onnx
  DROR: {method: dror, learnt_from: [ours]}
  everything: all
  places: position
labelled:
  ours: {scans: [wet], card: CARD, position: [places]}
  theirs: {scans: [wet/0.bin], card: CARD}
  elsewhere: {scans: [nowhere], card: CARD}
  dry: {scans: [dry], card: CARD, taken: [all, pedestrian, rain]}
clean: [clean]
timed: ours
"""


@pytest.fixture
def shared(tmp_path) -> Path:
    """Scans of 300 points: with thirty drops, with ten pedestrians' points, without labels."""
    card = tmp_path / "card.yaml"
    card.write_text(CARD)
    (tmp_path / "plan.yaml").write_text(PLAN.replace("CARD", str(card)))
    write_scenes(tmp_path / "wet", 300, 300, name="{}.bin", rain=3)
    write_scenes(tmp_path / "places", 300, name="{}.bin", rain=3)
    write_scenes(tmp_path / "dry", 300, name="{}.bin")
    write_labels(tmp_path / "dry/0.label", np.repeat([4, 0], [10, 290]))
    write_scenes(tmp_path / "clean", 300, name="roof.bin")
    return tmp_path


@pytest.fixture
def written(shared, monkeypatch, capsys) -> tuple[dict, str]:
    """The table as JSON and as text."""
    words = ["--plan", shared / "plan.yaml", "--shared", shared, "--work", shared / "work"]
    words += ["--out", shared / "table", "--times", 0, "--threads", 1]
    monkeypatch.setattr(sys, "argv", ["across_sensors.py", *map(str, words)])
    main()
    content = json.loads((shared / "table/table.json").read_text())
    text = capsys.readouterr().out
    assert (shared / "table/table.md").read_text() == text
    return content, text


def values(content: dict, title: str) -> dict[str, float]:
    (column,) = [column for column in content["columns"] if column["title"] == title]
    return {method: cell["value"] for method, cell in column["cells"].items()}


def test_its_figures_are_those_of_counting_by_hand(written, shared) -> None:
    content, _ = written
    dror = FilterDerainer(DROR(), 1)
    wet = [Scan.of(scene(300, seed=seed)) for seed in range(2)]
    called = np.array([dror(scan) for scan in wet])
    rain = np.broadcast_to(np.arange(300) >= 270, called.shape)
    iou = (called & rain).sum() / (called | rain).sum()
    ours = values(content, "ours")
    assert ours == {
        "nothing": 0.0,
        "everything": 0.1,
        "DROR": pytest.approx(iou),
        "places": ours["places"],
    }
    assert ours["places"] > 0.3  # the first of its two scans is where it learnt
    assert values(content, "dry: all")["DROR"] == pytest.approx(called[0].mean())
    assert values(content, "dry: pedestrian")["DROR"] == pytest.approx(called[0][:10].mean())
    assert values(content, "dry: pedestrian")["everything"] == 1
    clean = {"nothing": 0.0, "everything": 1.0, "DROR": pytest.approx(called[0].mean())}
    assert values(content, "roof") == values(content, "worst of the clean scans") == clean


def test_some_of_the_data_can_be_measured_alone(shared) -> None:
    plan = Plan.of_yaml(shared / "plan.yaml").with_data(["dry"])
    measurement = Measurement(plan, shared, shared / "work", threads=1)
    titles = [column.title for column in measurement.columns()]
    assert titles == ["dry: all", "dry: pedestrian", "dry: rain", "file"]


def test_it_names_what_it_leaves_out_and_why(written) -> None:
    content, text = written
    assert list(content["methods"]) == ["nothing", "DROR", "everything", "places"]
    assert content["methods"]["DROR"] == {"parameters": DROR().as_dict()}
    assert "no such method or file" in content["left_out"]["a model that is missing"]
    assert "is not there" in content["left_out"]["elsewhere"]
    assert "no others to learn places from" in content["left_out"]["places: theirs"]
    assert all(f"- {what} is left out: " in text for what in content["left_out"])
    assert values(content, "dry: rain") == {}
    assert "places" not in values(content, "theirs")


def test_what_a_method_scores_where_it_was_trained_is_marked(written) -> None:
    content, _ = written
    for column in content["columns"]:
        learnt = {method for method, cell in column["cells"].items() if cell["learnt"]}
        assert learnt == ({"DROR"} if column["title"] == "ours" else set())


def test_cells_are_short_and_distinguish_a_point_from_none() -> None:
    share, iou = Column("roof", "%", {}), Column("snow", "IoU", {})
    for value, text in {0: "0", 1e-5: ".001", 5.4e-4: ".054", 0.0131: "1.31", 1: "100.0"}.items():
        assert Column("roof", "%", {"a": Cell(value)}).text("a") == text
    assert Column("snow", "IoU", {"a": Cell(0.8434, learnt=True)}).text("a") == ".843 †"
    assert Column("snow", "IoU", {"a": Cell(1)}).text("a") == "1.000"
    assert share.heading == "roof, %"
    assert share.text("a") == iou.text("a") == "-"


def test_turned_it_holds_the_same_cells() -> None:
    columns = [
        Column("snow", "IoU", {"a": Cell(0.5), "b": Cell(0.25)}),
        Column("time", "ms", {"a": Cell(5)}),
    ]

    def cells(text: str) -> np.ndarray:
        lines = [line for line in text.splitlines() if "--" not in line]
        return np.array([[cell.strip() for cell in line.split("|")[1:-1]] for line in lines])

    upright, turned = (cells(table(columns, ["a", "b"], turned)) for turned in (False, True))
    np.testing.assert_array_equal(upright, turned.T)
    assert upright.tolist() == [
        ["method", "snow", "time, ms"],
        ["a", ".500", "5.0"],
        ["b", ".250", "-"],
    ]


def test_intensities_are_taken_to_the_unit_of_the_method() -> None:
    points = scene(300)
    points[:, 3] /= points[:, 3].max()
    scan = Scan.of(points)
    assert factor_for(CRF(), scan) == 255
    assert factor_for(CRF(), scan.with_intensity_times(255)) == 1
    assert factor_for(DROR(), scan) == 1
    assert factor_for(None, Scan.of(points[:, :3])) == 1
