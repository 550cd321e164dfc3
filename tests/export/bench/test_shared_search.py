"""What methods score: every point once, in every grouping, and a failure is never hidden."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from derain.evaluation.metrics import Counts
from derain.export.bench.contestants import Contestant, contestants
from derain.export.bench.scores import Labelled, score
from derain.filters import FILTERS, FilterDerainer
from derain.scan import Scan
from derain.views.neighbours import NeighbourView


def test_the_trivial_methods_are_counted_over_known_points(labelled: Labelled) -> None:
    everything, nothing = score(contestants(["all", "none"]), labelled, threads=1)
    assert everything.pooled == Counts(90, 790, 0, 0)
    assert nothing.pooled == Counts(0, 0, 90, 790)
    assert [counts.false_positive for counts in everything.per_scan] == [250, 270, 270]
    assert {name: c.called_rain for name, c in everything.by_class.items()} == {
        "solid": 790,
        "rain": 90,
    }


def test_scans_are_gathered_by_their_rain_rate(labelled: Labelled) -> None:
    (everything,) = score(contestants(["all"]), labelled, threads=1)
    assert everything.by_rain_rate == {
        "10 mm/h": Counts(60, 520, 0, 0),
        "25 mm/h": Counts(30, 270, 0, 0),
    }
    (unknown,) = score(contestants(["all"]), replace(labelled, rain_rate={}), threads=1)
    assert unknown.by_rain_rate == {}


def test_points_of_lidar_and_radar_are_counted_apart_where_they_are_known(
    labelled: Labelled,
) -> None:
    assert score(contestants(["all"]), labelled, threads=1)[0].by_sensor == {}

    def with_radar(path: Path) -> Scan:
        scan = labelled.read(path)
        return replace(scan, radar=np.arange(len(scan)) >= 290)

    (fused,) = score(contestants(["all"]), replace(labelled, read=with_radar), threads=1)
    assert fused.by_sensor == {"LiDAR": Counts(60, 790, 0, 0), "radar": Counts(30, 0, 0, 0)}


def test_filters_share_one_search_and_score_as_they_would_alone(
    labelled: Labelled, monkeypatch: pytest.MonkeyPatch
) -> None:
    searches = []
    view = NeighbourView.__call__

    def counted(self: NeighbourView, scan: Scan) -> object:
        searches.append(self.neighbours)
        return view(self, scan)

    rows = contestants(list(FILTERS))
    monkeypatch.setattr(NeighbourView, "__call__", counted)
    together = score(rows, labelled, threads=1)
    assert searches == [9, 9, 9]  # SSR looks at the most
    monkeypatch.undo()
    for row, scores in zip(rows, together, strict=True):
        expected = np.zeros(4, np.int64)
        for path in labelled.scans:
            scan = labelled.read(path)
            called, rain = FilterDerainer(row.filter, 1)(scan), scan.label == 3
            for place, part in enumerate((rain & called, ~rain & called, rain & ~called)):
                expected[place] += np.count_nonzero(part & (scan.label != 9))
        pooled = scores.pooled
        counted_so = [pooled.true_positive, pooled.false_positive, pooled.false_negative]
        assert counted_so == expected[:3].tolist()


def test_a_method_that_fails_on_a_scan_finds_nothing_there_and_says_why(
    labelled: Labelled,
) -> None:
    def fragile(scan: Scan, stopwatch: object) -> np.ndarray:
        if scan.name.endswith("1.bin"):
            raise MemoryError("no room")
        return np.ones(len(scan), bool)

    rows = [Contestant("fragile", "outdet", lambda threads: fragile), *contestants(["all"])]
    fails, holds = score(rows, labelled, threads=1)
    assert [Path(name).name for name in fails.failures] == ["1.bin"]
    assert list(fails.failures.values()) == ["no room"]
    assert fails.per_scan[1] == Counts(0, 0, 30, 270)
    assert fails.per_scan[::2] == holds.per_scan[::2]
    assert holds.failures == {}


def test_copies_of_a_point_count_once_where_that_is_asked(labelled: Labelled) -> None:
    def doubled(path: Path) -> Scan:
        scan = labelled.read(path)
        return scan.take(np.repeat(np.arange(len(scan)), 2))

    data = replace(labelled, read=doubled)
    assert score(contestants(["all"]), data, 1)[0].pooled == Counts(180, 1580, 0, 0)
    once = score(contestants(["all"]), replace(data, distinct=True), 1)
    assert once == score(contestants(["all"]), labelled, 1)
