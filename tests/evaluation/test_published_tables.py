"""The paper's tables, and ours beside them."""

from dataclasses import dataclass

import pytest

from derain.cards.card import DataCard, load_card
from derain.errors import InputError
from derain.evaluation.baselines import all_points
from derain.evaluation.published_tables import paper_table, scans_by_group
from derain.evaluation.scores import Scores, score
from derain.export.bench.report import with_published_rows
from derain.scan import Scan


@dataclass(frozen=True)
class OwnRow:
    """A row as a bench makes it, as far as the tables look at it."""

    title: str
    kind: str
    scores: Scores
    milliseconds: float = 10.4


@pytest.fixture
def scores(scans: list[Scan], card: DataCard) -> Scores:
    """What calling every point rain scores."""
    return score([all_points], scans, card)[0]


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


# What we call the published methods.
KINDS = {
    **{"3D-OutDet": "outdet", "SalsaNext": "salsanext", "LiSnowNet-L1": "lisnownet"},
    **{"DSOR": "dsor", "DROR": "dror"},
}


def test_table_2_is_that_of_the_paper() -> None:
    printed = set()
    for line in TABLE_2.splitlines():
        method, *figures = line.split()
        *scores, ms = map(float, figures)
        kind = KINDS[method]
        printed |= {
            (method, kind, "validation", *scores[:4], ms),
            (method, kind, "test", *scores[4:], ms),
        }
    rows = paper_table("table2").rows
    assert len(rows) == len(printed) == 10
    assert {(row.method, row.kind, row.group, *row.scores, row.ms) for row in rows} == printed
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
    assert all(row.kind == KINDS[row.method] for row in table.rows)
    assert table.groups == {"heavy": 50, "medium": 25, "light": 10}  # mm/h


def test_our_rows_stand_under_those_of_the_same_method(scores: Scores) -> None:
    names = {"all": "all", "dsor": "dsor", "DSOR, again": "dsor"}
    rows = [OwnRow(title, kind, scores) for title, kind in names.items()]
    text = with_published_rows(paper_table("table3"), {"heavy": rows}, load_card("rehearse3d"))
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
    (own,) = [line for line in text.splitlines() if line.startswith("| dsor, ours")]
    cells = [cell.strip() for cell in own.split("|")[2:-1]]
    # 90 of 880 points are rain: precision and IoU are 90 / 880, F1 is 180 / 970.
    assert cells == ["10.23", "100.00", "18.56", "10.23", "10", "pooled"]
    assert "(*)" not in text


def test_our_scores_are_averaged_as_the_published_ones_they_stand_under(scores: Scores) -> None:
    row = OwnRow("ours", "lisnownet", scores, milliseconds=float("nan"))
    text = with_published_rows(paper_table("table2"), {"test": [row]}, load_card("rehearse3d"))
    (own,) = [line for line in text.splitlines() if line.startswith("| ours")]
    # Of the 280 known points of the first scan and the 300 of the others, 30 are rain in each.
    iou = 100 * (30 / 280 + 30 / 300 + 30 / 300) / 3
    cells = [cell.strip() for cell in own.split("|")[2:-1]]
    assert cells[3:] == [f"{iou:.2f}", "-", "scans"]


def test_simulated_rain_stands_beside_simulated_rain_and_misprints_are_marked(
    scores: Scores,
) -> None:
    ours = {name: [OwnRow("dsor", "dsor", scores)] for name in ("heavy", "medium", "light")}
    text = with_published_rows(paper_table("table3"), ours, load_card("simulated"))
    assert "Ours on simulated rain." in text
    assert text.count("| DSOR, published (*)") == 2
    assert "(*) DSOR, medium: F1 of this precision and recall is 81.59." in text
    assert "(*) DSOR, light: F1 and IoU are those of a recall of 99.9, not 94.34." in text
    assert "27.08" not in text


def test_table_3_takes_the_test_scans_of_each_rain_rate() -> None:
    split = {"validation": ["a"], "test": ["b", "c", "d"]}
    rates = {"a": 25.0, "b": 50.0, "c": 10.0}
    table3, table2 = paper_table("table3"), paper_table("table2")
    by_rate = scans_by_group(table3, split.__getitem__, rates.get)
    assert by_rate == {"heavy": ["b"], "light": ["c"]}
    assert list(by_rate) == ["heavy", "light"]
    assert scans_by_group(table2, split.__getitem__, rates.get) == split
    with pytest.raises(InputError, match=r"no test scan is known to have .* Give --rain-rates"):
        scans_by_group(table3, split.__getitem__, {"b": 30.0}.get)
