"""Methods side by side: exact counts over all scans, and the median time of each stage."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from derain.cards import DataCard
from derain.errors import InputError
from derain.export.comparison import Row, as_table, compare
from derain.metrics import Counts
from derain.scan import Scan
from derain.stopwatch import Stopwatch

CARD = DataCard("made up", {0: "solid", 3: "rain", 4: "snow"}, rain=(3, 4))

LABELS = {
    Path("first"): [3, 3, 0, 0, 0, 4],
    Path("second"): [0, 0],
    Path("empty"): [],
    Path("third"): [4, 4, 0],
}


def read(path: Path) -> Scan:
    label = np.array(LABELS[path], np.int64)
    return Scan(np.full((len(label), 3), 5, np.float32), label=label, name=str(path))


def nothing(scan: Scan, stopwatch: Stopwatch) -> NDArray[np.bool_]:
    return np.zeros(len(scan), bool)


def everything(scan: Scan, stopwatch: Stopwatch) -> NDArray[np.bool_]:
    return np.ones(len(scan), bool)


def only_class_3(scan: Scan, stopwatch: Stopwatch) -> NDArray[np.bool_]:
    return scan.label == 3


def test_each_method_is_counted_over_the_points_of_all_scans() -> None:
    methods = {"nothing": nothing, "everything": everything, "only class 3": only_class_3}
    rows = compare(methods, list(LABELS), read, CARD)
    assert {row.method: row.counts for row in rows} == {
        "nothing": Counts(0, 0, 5, 6),
        "everything": Counts(5, 6, 0, 0),
        "only class 3": Counts(2, 0, 3, 6),
    }


def test_the_time_of_a_stage_is_the_median_over_scans() -> None:
    network = iter([10.0, 40.0, 20.0, 30.0])

    def timed(scan: Scan, stopwatch: Stopwatch) -> NDArray[np.bool_]:
        stopwatch.milliseconds["network"] = next(network)
        return nothing(scan, stopwatch)

    (row,) = compare({"timed": timed}, list(LABELS), read, CARD)
    assert list(row.milliseconds) == ["read", "network"]
    assert row.milliseconds["network"] == 25.0
    assert row.milliseconds["read"] > 0


def test_a_label_that_the_card_does_not_name_is_refused() -> None:
    card = DataCard("other", {0: "solid", 3: "rain"}, rain=(3,))
    with pytest.raises(InputError, match="id 4 is no known class"):
        compare({"nothing": nothing}, [Path("third")], read, card)


def test_the_table_is_aligned_markdown() -> None:
    rows = [
        Row("a network", Counts(5, 6, 0, 0), {"read": 1.0, "view": 20.25, "network": 3, "back": 1}),
        Row("a rule", Counts(2, 0, 3, 6), {"read": 1.0}),
    ]
    assert as_table(rows).splitlines() == [
        "| method    |     P |     R |    F1 |   IoU | read ms | view ms | network ms | back ms "
        "| total ms |",
        "|-----------|------:|------:|------:|------:|--------:|--------:|-----------:|--------:"
        "|---------:|",
        "| a network | 0.455 | 1.000 | 0.625 | 0.455 |     1.0 |    20.2 |        3.0 |     1.0 "
        "|     25.2 |",
        "| a rule    | 1.000 | 0.400 | 0.571 | 0.400 |     1.0 |     0.0 |        0.0 |     0.0 "
        "|      1.0 |",
    ]
