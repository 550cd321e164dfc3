"""What methods score: every point once, in every grouping, and a failure is never hidden."""

from dataclasses import replace

import numpy as np

from derain.evaluation.baselines import all_points, no_points
from derain.evaluation.counts import Counts
from derain.evaluation.scores import score
from derain.scan import Scan


def test_the_trivial_methods_are_counted_over_known_points(scans, card) -> None:
    everything, nothing = score([all_points, no_points], scans, card)
    assert everything.pooled == Counts(90, 790, 0, 0)
    assert nothing.pooled == Counts(0, 0, 90, 790)
    assert [counts.false_positive for counts in everything.per_scan] == [250, 270, 270]
    assert {name: c.called_rain for name, c in everything.by_class.items()} == {
        "solid": 790,
        "rain": 90,
    }


def test_scans_are_gathered_by_their_rain_rate(scans, card) -> None:
    (everything,) = score([all_points], scans, card, rain_rates=[10.0, 25.0, 10.0])
    assert everything.by_rain_rate == {
        "10 mm/h": Counts(60, 520, 0, 0),
        "25 mm/h": Counts(30, 270, 0, 0),
    }
    (partly,) = score([all_points], scans, card, rain_rates=[None, 25.0, None])
    assert list(partly.by_rain_rate) == ["25 mm/h"]
    assert score([all_points], scans, card)[0].by_rain_rate == {}


def test_points_of_lidar_and_radar_are_counted_apart_where_they_are_known(scans, card) -> None:
    assert score([all_points], scans, card)[0].by_sensor == {}
    of_radar = np.arange(300) >= 290
    (fused,) = score([all_points], [replace(scan, radar=of_radar) for scan in scans], card)
    assert fused.by_sensor == {"LiDAR": Counts(60, 790, 0, 0), "radar": Counts(30, 0, 0, 0)}


def test_a_method_that_fails_on_a_scan_finds_nothing_there_and_the_reason_is_printed(
    scans, card
) -> None:
    def fragile(scan: Scan) -> np.ndarray:
        if scan.name == "scan 1":
            raise MemoryError("no room")
        return np.ones(len(scan), bool)

    fails, holds = score([fragile, all_points], scans, card)
    assert fails.failures == {"scan 1": "no room"}
    assert fails.per_scan[1] == Counts(0, 0, 30, 270)
    assert fails.per_scan[::2] == holds.per_scan[::2]
    assert holds.failures == {}


def test_copies_of_a_point_count_once_where_that_is_asked(scans, card) -> None:
    doubled = [scan.take(np.repeat(np.arange(len(scan)), 2)) for scan in scans]
    assert score([all_points], doubled, card)[0].pooled == Counts(180, 1580, 0, 0)
    (once,) = score([all_points], doubled, card, distinct=True)
    assert once.to_json() == score([all_points], scans, card)[0].to_json()
