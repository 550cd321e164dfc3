"""The bench's files: one set of figures, readable by people, spreadsheets and programs."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread

from derain.evaluation.counts import or_none
from derain.evaluation.scores import Scores, score
from derain.export.bench.bench import Bench, scored_methods
from derain.export.bench.bench_entries import FILE_SIZE, BenchEntry, bench_entries
from derain.export.bench.cost import Cost
from derain.export.bench.labelled_frames import LabelledFrames
from derain.export.bench.report import (
    SIMULATED_IS_EASY,
    as_markdown,
    draw_speed_error,
    write_report,
)
from derain.export.bench.rows import Row, bench_rows
from derain.export.timing import STAGES, RunTimes

FACTS = {
    "title": "made up, 3 scans",
    "command": "derain bench",
    "simulated": False,
    "versions": "derain 1",
    "processor": "abacus",
}


def cost(milliseconds: float) -> Cost:
    return Cost(RunTimes({stage: np.full(5, milliseconds / 4) for stage in STAGES}), 100.0)


def scored(methods: list[BenchEntry], data: LabelledFrames) -> list[Scores]:
    rates = [data.rain_rates.get(frame.sequence) for frame in data.frames]
    scans = map(data.reader.read, data.frames)
    return score(scored_methods(methods, 1), scans, data.reader.card, rain_rates=rates)


@pytest.fixture
def rows(labelled) -> list[Row]:
    """A filter, a baseline, and a method that fails wherever it is run."""

    def broken(scan: object, stopwatch: object) -> np.ndarray:
        raise MemoryError("no room")

    methods = [*bench_entries(["dror", "all"]), BenchEntry("broken", "outdet", lambda _: broken)]
    failed = Cost(RunTimes.of_no_runs(), None, "no room")
    scores = scored(methods, labelled)
    return bench_rows(methods, scores, [cost(40), cost(4), failed], np.random.default_rng(0))


def test_json_and_csv_hold_the_same_figures(rows, tmp_path) -> None:
    write_report(rows, FACTS, tmp_path / "out")
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert written == {"bench.csv", "bench.json", "bench.md"}
    content = json.loads((tmp_path / "out/bench.json").read_text())
    assert content["command"] == "derain bench"
    with (tmp_path / "out/bench.csv").open() as file:
        lines = list(csv.DictReader(file))
    for row, in_json, in_csv in zip(rows, content["rows"], lines, strict=True):
        assert in_json["method"] == in_csv["method"] == row.title
        for name in ("precision", "recall", "f1", "iou"):
            assert in_json[name] == or_none(getattr(row.scores.pooled, name))
            assert in_csv[name] == ("" if in_json[name] is None else str(in_json[name]))
        ends = [float(in_csv[f"iou_interval.{end}"]) for end in ("low", "high")]
        assert in_json["iou_interval"] == ends
        of_rate = in_json["by_rain_rate"]["10 mm/h"]["iou"]
        assert of_rate == float(in_csv["by_rain_rate.10 mm/h.iou"])
    assert [row["ms"] for row in content["rows"]] == [40.0, 4.0, None]
    assert [line["ms"] for line in lines] == ["40.0", "4.0", ""]
    assert content["rows"][0]["parameters"]["azimuth_resolution"] == 0.16
    assert content["rows"][2]["precision"] is None  # it called nothing rain
    assert content["rows"][2]["by_range"]["80+ m"]["iou"] is None  # no point is as far


def test_the_tables_name_every_method_and_what_failed(rows) -> None:
    text = as_markdown(rows, FACTS)
    parts = {part.splitlines()[0]: part for part in text.split("\n## ")}
    for heading in ("Called rain, by class", "IoU by range", "IoU by rain rate"):
        assert all(f"| {row.title} " in parts[heading] for row in rows)
    assert "broken: 3 of 3 scans, first" in text
    assert "broken could not be timed: no room" in text
    assert "IoU by sensor" not in parts
    # A score that is undefined is a dash: the first finds nothing in the farthest band.
    (main,) = [line for line in text.splitlines() if line.startswith("| broken (!) |")]
    assert [cell.strip() for cell in main.split("|")[2:6]] == ["-", "0.000", "0.000", "0.000"]
    by_range = parts["IoU by range"].splitlines()
    assert all(line.split()[-2] == "-" for line in by_range if "dror" in line)


def test_a_printed_bench_states_why_a_method_failed(rows) -> None:
    text = str(Bench(rows, {}))
    assert "broken could not be timed: no room" in text
    assert "dror could" not in text


def test_simulated_data_are_called_so_and_one_scan_has_no_interval(rows, labelled) -> None:
    assert SIMULATED_IS_EASY not in as_markdown(rows, FACTS)
    assert SIMULATED_IS_EASY in as_markdown(rows, {**FACTS, "simulated": True})
    one = replace(labelled, frames=labelled.frames[:1])
    methods = bench_entries(["all"])
    (row,) = bench_rows(methods, scored(methods, one), [cost(4)], np.random.default_rng(0))
    assert row.iou_interval is None
    assert row.as_dict()["iou_behind_best_interval"] is None


def test_the_picture_shows_methods_with_a_time_and_an_iou_and_how_large_files_are(
    rows, tmp_path, saved_figures
) -> None:
    filter_, baseline, failed = rows
    of_file = replace(filter_, bench_entry=replace(filter_.bench_entry, facts={FILE_SIZE: 67_535}))
    dry = replace(filter_, scores=Scores(filter_.scores.card))
    draw_speed_error([of_file, baseline, failed, dry], FACTS, tmp_path / "speed_error.png")
    ((axes,),) = [figure.axes for figure in saved_figures]
    assert [text.get_text() for text in axes.texts] == ["dror · 68 kB", "all"]
    assert axes.get_title() == "made up, 3 scans, abacus"
    shown = {dots.get_label(): dots.get_offsets().tolist() for dots in axes.collections}
    dror, everything = (1 - row.scores.pooled.iou for row in (filter_, baseline))
    assert 0 < dror < 1
    assert shown == {"filter": [[40, dror]], "baseline": [[4, everything]]}
    height, width, _ = imread(tmp_path / "speed_error.png").shape
    assert width > height > 500
