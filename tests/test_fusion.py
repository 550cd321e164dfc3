"""LiDAR and radar joined: pairs in time and labels by brute force, and the parts had back."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.files import read_scan, write_scan
from derain.files.extrinsics import motion_of_pose, moved
from derain.fusion import (
    LABEL_WITHIN,
    NO_DETECTIONS,
    UNKNOWN,
    fuse,
    nearest_in_time,
    transfer_labels,
)
from derain.scan import Scan

PLACE = motion_of_pose(1.5, -0.3, -0.7, 1, -2, 3)
HERE = np.eye(4)

# Multiples of a quarter are exact, so that ties are ties.
quarters = st.integers(-20, 20).map(lambda number: number / 4)


def radar_frame(points: int = 30, seed: int = 1) -> Scan:
    random = np.random.default_rng(seed)
    xyz = random.uniform(-20, 20, (points, 3)).astype(np.float32)
    fields = {"doppler": random.normal(size=points), "rcs": np.arange(points)}
    return Scan(xyz, fields={**dict(zip("xyz", xyz.T, strict=True)), **fields}, name="frame.npz")


@given(st.lists(quarters, max_size=12), st.lists(quarters, max_size=12), quarters.map(abs))
def test_pairs_in_time_are_those_that_brute_force_finds(times, among, within) -> None:
    expected = []
    for time in times:
        # The nearest; of equally near ones the earlier; of equal ones the first.
        rank = [(abs(other - time), other, row) for row, other in enumerate(among)]
        distance, _, row = min(rank, default=(math.inf, 0.0, -1))
        expected.append(row if distance <= within else -1)
    found = nearest_in_time(np.array(times), np.array(among), within)
    assert found.tolist() == expected
    assert found.dtype == np.int64


def test_the_lidar_comes_first_and_both_keep_their_order() -> None:
    lidar, radar = Scan.of(scene(100)), radar_frame()
    fused = fuse(lidar, radar, PLACE)
    assert fused.radar.tolist() == [False] * 100 + [True] * 30
    np.testing.assert_array_equal(fused.xyz[:100], lidar.xyz)
    np.testing.assert_array_equal(fused.xyz[100:], moved(radar.xyz, PLACE))
    np.testing.assert_array_equal(fused.intensity[:100], lidar.intensity)
    assert (fused.intensity[100:] == 0).all()
    assert fused.label is None


def test_a_radar_that_knows_its_labels_keeps_them() -> None:
    lidar = Scan.of(scene(10)).with_label(np.zeros(10, np.int64))
    radar = replace(radar_frame(3), intensity=np.array([1, 2, 3], np.float32))
    fused = fuse(lidar, radar.with_label(np.array([1, 2, 3])), PLACE)
    assert fused.label[10:].tolist() == [1, 2, 3]
    assert fused.intensity[10:].tolist() == [1, 2, 3]
    found = fuse(lidar, radar, HERE, label_within=1000).label
    np.testing.assert_array_equal(found[10:], transfer_labels(lidar, radar.xyz, within=1000))
    with pytest.raises(InputError, match="it has no labels"):
        transfer_labels(radar, lidar.xyz)


def test_rows_that_cannot_be_judged_stay_as_they_are() -> None:
    xyz = np.array([[0, 0, 0], [np.nan, 1, 2], [np.inf, 0, 0], [5, 0, 0]], np.float32)
    fused = fuse(Scan.of(scene(5)), Scan(xyz), PLACE)
    np.testing.assert_array_equal(fused.xyz[5:8], xyz[:3])
    assert fused.valid[5:].tolist() == [False, False, False, True]


def test_a_file_with_channels_names_them_and_marks_the_sensor_of_each_point(tmp_path) -> None:
    lidar, radar = Scan.of(scene(50)), radar_frame()
    fused = fuse(lidar, radar, PLACE, channels=["rcs", "doppler"])
    write_scan(tmp_path / "fused.npz", fused)
    again = read_scan(tmp_path / "fused.npz")
    assert list(again.fields) == ["x", "y", "z", "intensity", "radar", "rcs", "doppler"]
    np.testing.assert_array_equal(again.xyz, fused.xyz)
    np.testing.assert_array_equal(again.intensity, fused.intensity)
    np.testing.assert_array_equal(again.fields["radar"] == 1, fused.radar)
    np.testing.assert_array_equal(again.fields["rcs"][50:], np.arange(30))
    assert again.valid.all()


def test_a_motion_that_is_not_rigid_is_refused() -> None:
    with pytest.raises(ValueError, match="not a rotation"):
        fuse(Scan.of(scene(5)), radar_frame(), 2 * HERE)


def test_a_scan_without_a_radar_frame_stays_alone() -> None:
    lidar = Scan.of(scene(20)).with_label(np.ones(20, np.int64))
    fused = fuse(lidar, NO_DETECTIONS, PLACE, channels=["rcs"])
    assert (len(fused), fused.radar.any()) == (20, False)
    assert np.isnan(fused.fields["rcs"]).all()
    np.testing.assert_array_equal(fused.label, lidar.label)


def test_a_channel_that_the_radar_lacks_is_named() -> None:
    with pytest.raises(InputError, match=r"frame\.npz: has no column snr .*x, y, z, doppler"):
        fuse(Scan.of(scene(5)), radar_frame(), PLACE, channels=["snr"])


@pytest.mark.parametrize("channel", ["x", "intensity", "radar"])
def test_a_channel_does_not_take_the_place_of_a_merged_column(channel) -> None:
    with pytest.raises(InputError, match=f"{channel}: is a column of the merged cloud itself"):
        fuse(Scan.of(scene(5)), radar_frame(), PLACE, channels=["rcs", channel])


@pytest.mark.parametrize(("name", "scan"), list(hard_cases(2000)))
def test_every_hard_case_is_fused_from_either_side(name, scan) -> None:
    ordinary = radar_frame()
    labelled = scan.with_label(np.zeros(len(scan), np.int64))
    for lidar, radar in ((labelled, ordinary), (Scan.of(scene(20)), scan)):
        fused = fuse(lidar, radar, HERE)
        valid = np.concatenate([lidar.valid, radar.valid])
        np.testing.assert_array_equal(fused.valid, valid)


def labelled(xyz: object, label: object) -> Scan:
    return Scan(np.asarray(xyz, np.float32), label=np.asarray(label, np.int64))


@given(st.integers(0, 2**32 - 1), st.integers(0, 40), st.integers(0, 40), st.floats(0.01, 5))
def test_labels_are_those_that_brute_force_finds(seed, sources, queries, within) -> None:
    random = np.random.default_rng(seed)
    # On a coarse lattice, off which the queries lie: many duplicates, no other ties.
    scan = labelled(random.integers(1, 4, (sources, 3)), np.arange(sources))
    xyz = (random.integers(1, 4, (queries, 3)) + random.uniform(0, 0.3, (queries, 3))).astype("f4")
    expected = []
    for query in xyz.astype(float):
        distance = np.linalg.norm(scan.xyz - query, axis=1)
        near = len(distance) > 0 and distance.min() <= within
        expected.append(distance.argmin() if near else UNKNOWN)  # argmin takes the first of equals
    assert transfer_labels(scan, xyz, within).tolist() == expected


def test_the_bound_is_inclusive() -> None:
    scan = labelled([[5, 0, 0]], [7])
    xyz = np.array([[5, 0.5, 0], [5, np.nextafter(np.float32(0.5), 1), 0]], np.float32)
    assert transfer_labels(scan, xyz, within=0.5).tolist() == [7, UNKNOWN]
    assert LABEL_WITHIN == 1  # the default
    assert transfer_labels(scan, xyz + np.float32([0, 0.4, 0])).tolist() == [7, 7]
    assert transfer_labels(scan, xyz + np.float32([0, 0.6, 0])).tolist() == [UNKNOWN, UNKNOWN]


def test_points_that_cannot_be_judged_neither_give_nor_get_labels() -> None:
    scan = labelled([[0, 0, 0], [np.nan, 0, 0], [0.1, 3, 0], [3, 0, 0]], [1, 2, 3, UNKNOWN])
    xyz = np.array([[0.1, 0, 0], [0.2, 3, 0], [3, 0, 0.1]], np.float32)
    assert transfer_labels(scan, xyz).tolist() == [UNKNOWN, 3, UNKNOWN]
    near = labelled([[0.1, 0, 0]], [1])
    lost = np.array([[0, 0, 0], [np.nan, 0, 0], [np.inf, 0, 0]], np.float32)
    assert transfer_labels(near, lost).tolist() == 3 * [UNKNOWN]
