"""The paper's tables, and ours beside them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from derain.cards.card import load_card
from derain.datamodules.base import Loading
from derain.datamodules.labelled import labelled_scans
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export.bench.contestants import contestants
from derain.export.bench.cost import Cost
from derain.export.bench.paper import TABLES, beside_published, files_by_group, paper_table
from derain.export.bench.rows import Row, joined
from derain.export.bench.scores import Labelled, score
from derain.export.timing import STAGES
from derain.files.labels import write_labels


def rows_of(names: Sequence[str], data: Labelled) -> list[Row]:
    methods = contestants(names)
    costs = [Cost({stage: np.full(3, 10.0) for stage in STAGES}, 50.0) for _ in methods]
    return joined(methods, score(methods, data, 1), costs, np.random.default_rng(0))


# The tables as they stand on the paper's pages, two groups side by side, copied by hand.
TABLE_2 = """\
3D-OutDet    96.35 98.48 97.40 94.94  97.23 96.61 96.92 94.03   82
SalsaNext    95.17 99.41 97.24 94.61  95.81 99.07 97.41 94.92   97
LiSnowNet-L1 14.42 31.94 19.55 12.44  21.22 37.70 26.07 16.86  131
DSOR         15.50 38.18 22.05 12.39  25.73 49.33 33.82 20.35  253
DROR          5.88 76.32 10.91  5.77  10.78 73.48 18.81 10.38  199
"""
TABLE_3 = """\
3D-OutDet heavy  99.99 99.99 99.99 99.99  98.30 96.43 97.35 94.85
3D-OutDet medium 99.99 99.99 99.99 99.99  97.88 95.89 96.87 93.93
3D-OutDet light  99.99 99.99 99.99 99.99  98.08 98.67 98.38 96.81
DSOR      heavy  78.58 99.59 87.85 78.33  27.08 39.46 32.12 19.13
DSOR      medium 69.00 99.81 91.59 68.91  38.24 56.27 45.54 29.48
DSOR      light  55.03 94.34 70.97 55.00  23.35 35.95 28.31 16.49
"""


def test_table_2_is_that_of_the_paper() -> None:
    printed = set()
    for line in TABLE_2.splitlines():
        method, *figures = line.split()
        *scores, ms = map(float, figures)
        printed |= {
            (method, "validation", *scores[:4], ms),
            (method, "test", *scores[4:], ms),
        }
    rows = paper_table("table2").rows
    assert len(rows) == len(printed) == 10
    assert {(row.method, row.group, *row.scores, row.ms) for row in rows} == printed
    assert not any(row.simulated for row in rows)


def test_table_3_is_that_of_the_paper() -> None:
    printed = set()
    for line in TABLE_3.splitlines():
        method, rain, *figures = line.split()
        scores = [float(figure) for figure in figures]
        printed |= {(method, rain, True, *scores[:4]), (method, rain, False, *scores[4:])}
    table = paper_table("table3")
    assert len(table.rows) == len(printed) == 12
    assert {(row.method, row.group, row.simulated, *row.scores) for row in table.rows} == printed
    assert table.groups == {"heavy": 50, "medium": 25, "light": 10}  # mm/h


@pytest.mark.parametrize("name", TABLES)
def test_every_published_method_is_one_of_ours(name: str) -> None:
    ours = {
        "3D-OutDet": "outdet",
        "SalsaNext": "salsanext",
        "LiSnowNet-L1": "lisnownet",
        "DSOR": "dsor",
        "DROR": "dror",
    }
    assert all(row.kind == ours[row.method] for row in paper_table(name).rows)


def test_our_rows_stand_under_those_of_the_same_method(labelled: Labelled) -> None:
    rows = rows_of(["all", "dsor", "DSOR, again=dsor"], labelled)
    text = beside_published(paper_table("table3"), {"heavy": rows}, load_card("rehearse3d"))
    titles = [line.split("|")[1].strip() for line in text.splitlines() if line.startswith("| ")]
    assert titles == [
        "method",
        "3D-OutDet, published",
        "DSOR, published",
        "dsor, ours",
        "DSOR, again, ours",
        "all, ours",
    ]
    assert "| 27.08 |  39.46 | 32.12 | 19.13 |" in text
    iou = 100 * rows[1].scores.pooled.iou
    (own,) = [line for line in text.splitlines() if line.startswith("| dsor, ours")]
    assert f" {iou:.2f} |" in own
    assert "(*)" not in text


def test_simulated_rain_stands_beside_simulated_rain_and_misprints_are_marked(
    labelled: Labelled,
) -> None:
    ours = {name: rows_of(["dsor"], labelled) for name in ("heavy", "medium", "light")}
    text = beside_published(paper_table("table3"), ours, load_card("simulated"))
    assert "Ours on simulated rain." in text
    assert text.count("| DSOR, published (*)") == 2
    assert "(*) DSOR, medium: F1 of this precision and recall is 81.59." in text
    assert "(*) DSOR, light: F1 and IoU are those of a recall of 99.9, not 94.34." in text
    assert "27.08" not in text


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A data set in the layout of REHEARSE-3D, with two test sequences and one of validation."""
    for sequence in ("001", "005", "006"):
        folder = tmp_path / "sequences" / sequence
        scan = folder / "lidar_radar_pcd/0.bin"
        scan.parent.mkdir(parents=True)
        scene(20).tofile(scan)
        write_labels(folder / "lidar_radar_labels/0.label", np.zeros(20, np.int64))
    return tmp_path


def test_table_3_takes_the_test_scans_of_each_rain_rate(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = labelled_scans([root], load_card("rehearse3d"), Loading())
    monkeypatch.setattr(data, "split", {"validation": ["001"], "test": ["005", "006"]})
    table3, table2 = paper_table("table3"), paper_table("table2")
    by_rate = files_by_group(table3, data, {"001": 25.0, "005": 50.0, "006": 10.0})
    assert {
        name: [f.scan.parent.parent.name for f in files] for name, files in by_rate.items()
    } == {
        "heavy": ["005"],
        "light": ["006"],
    }
    by_part = files_by_group(table2, data, {})
    assert {name: len(files) for name, files in by_part.items()} == {"validation": 1, "test": 2}
    with pytest.raises(InputError, match=r"no test scan is known to have .* Give --rain-rates"):
        files_by_group(table3, data, {"005": 30.0})
