"""No hard case is hard in name only. Runtime, filters and commands are tried on each elsewhere."""

import numpy as np

from derain.evaluation.hard_cases import hard_cases

SCANS = dict(hard_cases(largest=50))


def test_points_are_as_many_as_valid_and_as_distinct_as_their_names_promise() -> None:
    valid = {name: int(scan.valid.sum()) for name, scan in SCANS.items()}
    assert (valid["empty"], valid["one point"], valid["nothing valid"]) == (0, 1, 0)
    assert 1 < valid["fewer points than neighbours"] < 9
    assert len(np.unique(SCANS["all points identical"].xyz, axis=0)) == 1
    assert len(np.unique(SCANS["40 % duplicates"].xyz, axis=0)) == 3000 < 5000
    for name in ("NaN and infinite rows", "points at the origin", "sentinel cells"):
        assert valid[name] == 2700, name
    assert valid["50 points"] == 50
    assert SCANS["no intensity"].intensity is None
    for intensity in ("0", "65,535"):
        assert set(SCANS[f"intensity {intensity}"].intensity) == {int(intensity.replace(",", ""))}


def test_points_lie_where_their_names_promise() -> None:
    for name, reach in (("range 1e-6 m", 1e-6), ("range 1e4 m", 1e4), ("constant image", 10)):
        np.testing.assert_allclose(SCANS[name].range, reach, rtol=1e-5)
    azimuth = np.arctan2(*SCANS["azimuth ±π"].xyz[:, 1::-1].T)
    assert set(azimuth) == {np.float32(np.pi), np.float32(-np.pi)}
    assert not SCANS["at the poles"].xyz[:, :2].any()
    for name, low, high in (("a grid row", -3, -1), ("many grid rows", -20, 3)):
        x, y, z = SCANS[f"{name} without returns"].xyz.T
        inclination = np.degrees(np.arctan2(z, np.hypot(x, y)))
        assert not ((inclination > low) & (inclination < high)).any()
        assert inclination.min() < low < high < inclination.max()
