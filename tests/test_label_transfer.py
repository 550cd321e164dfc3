"""Labels of the nearest point: against brute force, and where there is none to take."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.fusion import LABEL_WITHIN, UNKNOWN, transfer_labels
from derain.scan import Scan


def labelled(xyz: object, label: object) -> Scan:
    return Scan(np.asarray(xyz, np.float32), label=np.asarray(label, np.int64))


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 40), st.integers(0, 40), st.floats(0.01, 5))
def test_labels_are_those_that_brute_force_finds(
    seed: int, sources: int, queries: int, within: float
) -> None:
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


def test_by_default_a_label_reaches_a_metre() -> None:
    scan = labelled([[50, 0, 0]], [7])
    xyz = np.array([[50.9, 0, 0], [51.1, 0, 0]], np.float32)
    assert LABEL_WITHIN == 1
    assert transfer_labels(scan, xyz).tolist() == [7, UNKNOWN]


def test_a_lidar_point_that_cannot_be_judged_gives_no_label() -> None:
    scan = labelled([[0, 0, 0], [np.nan, 0, 0], [3, 0, 0]], [1, 2, 3])
    xyz = np.array([[0.1, 0, 0], [3, 0, 0.1]], np.float32)
    assert transfer_labels(scan, xyz).tolist() == [UNKNOWN, 3]


def test_a_point_that_cannot_be_judged_gets_no_label() -> None:
    scan = labelled([[0.1, 0, 0]], [1])
    xyz = np.array([[0, 0, 0], [np.nan, 0, 0], [np.inf, 0, 0], [0.2, 0, 0]], np.float32)
    assert transfer_labels(scan, xyz).tolist() == [UNKNOWN, UNKNOWN, UNKNOWN, 1]


def test_an_unknown_label_is_passed_on() -> None:
    scan = labelled([[1, 0, 0]], [UNKNOWN])
    assert transfer_labels(scan, scan.xyz).tolist() == [UNKNOWN]


@pytest.mark.parametrize(("name", "scan"), list(hard_cases(3000)))
def test_every_hard_case_gives_labels_and_gets_them(name: str, scan: Scan) -> None:
    ordinary = Scan.of(scene(200)).with_label(np.arange(200))
    gets = transfer_labels(ordinary, scan.xyz)
    assert gets.shape == (len(scan),)
    assert (gets[~scan.valid] == UNKNOWN).all()
    gives = transfer_labels(scan.with_label(np.ones(len(scan), np.int64)), ordinary.xyz)
    assert set(gives) <= {1, UNKNOWN}


def test_a_scan_without_labels_is_refused() -> None:
    with pytest.raises(InputError, match="array: it has no labels"):
        transfer_labels(Scan.of(scene(5)), scene(5)[:, :3])
