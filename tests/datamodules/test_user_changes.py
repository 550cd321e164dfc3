"""What users do to scans: each change keeps labels beside their points, and is what it is named."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.datamodules.user_changes import (
    ALL_CHANGES,
    FEWEST_POINTS,
    TILT,
    across,
    along,
    changed_as_by_users,
    in_sector,
)
from derain.evaluation.hard_cases import scene
from derain.scan import Float32s, Floats, Scan


def street() -> Scan:
    return Scan.of(scene(2000)).with_label(np.arange(2000))


def directions(xyz: Float32s) -> Floats:
    wide = xyz.astype(np.float64)
    directions: Floats = wide / np.linalg.norm(wide, axis=1, keepdims=True)
    return directions


@pytest.mark.parametrize("name", ALL_CHANGES)
@pytest.mark.parametrize("seed", range(3))
def test_points_stay_near_their_places_beside_labels_and_intensities(name, seed) -> None:
    scan = street()
    changed = ALL_CHANGES[name](scan, np.random.default_rng(seed))
    assert np.isfinite(changed.xyz).all()
    assert len(changed) >= FEWEST_POINTS
    np.testing.assert_array_equal(changed.intensity, scan.intensity[changed.label])
    before = scan.xyz[changed.label]
    if name in ("thinned", "cut"):
        np.testing.assert_array_equal(changed.xyz, before)
        assert len(changed) <= len(scan)
    elif name == "tilted":
        ranges = np.linalg.norm(changed.xyz, axis=1)
        np.testing.assert_allclose(ranges, np.linalg.norm(before, axis=1), rtol=1e-4)
        angle = np.arccos((directions(changed.xyz) * directions(before)).sum(axis=1).clip(-1, 1))
        assert np.degrees(angle).max() <= TILT + 0.1
    elif name == "scaled":
        np.testing.assert_allclose(directions(changed.xyz), directions(before), atol=1e-5)
    else:
        moved = (changed.xyz - before).astype(np.float64)
        assert np.linalg.norm(moved, axis=1).max() < 5
        assert (changed.xyz != before).any()
    if name == "doubled":
        assert len(scan) < len(changed) <= 2 * len(scan)
    if name == "moved":
        np.testing.assert_allclose(moved, np.broadcast_to(moved[0], moved.shape), atol=1e-4)


def test_noise_is_along_the_ray_or_across_it() -> None:
    generator, xyz = np.random.default_rng(0), street().xyz
    shift = along(xyz, generator.normal(0, 0.02, len(xyz))) - xyz
    aside = across(xyz, 0.02, generator) - xyz
    rays = directions(xyz)
    assert np.abs(np.cross(shift, rays)).max() < 1e-4
    np.testing.assert_allclose((aside * rays).sum(axis=1), 0, atol=1e-4)
    assert np.linalg.norm(aside, axis=1).mean() == pytest.approx(0.02 * np.sqrt(np.pi / 2), rel=0.1)


def test_every_change_is_drawn_and_no_two_scans_are_changed_alike() -> None:
    scan = street()
    sizes = {len(changed_as_by_users(scan, np.random.default_rng(seed))) for seed in range(60)}
    assert min(sizes) < len(scan) < max(sizes)
    assert len(sizes) > 10


@given(st.integers(0, 2**32))
def test_a_sector_is_all_that_there_is_between_two_azimuths(seed) -> None:
    scan = Scan.of(scene(500))
    kept = in_sector(scan, 70, np.random.default_rng(seed))
    azimuth = np.degrees(np.arctan2(scan.xyz[:, 1], scan.xyz[:, 0]))
    # Some direction is the middle of what is kept, and has nothing of the rest within 35 degrees.
    middles = np.arange(-180, 180, 0.5)
    off = np.abs((azimuth[:, None] - middles + 180) % 360 - 180)
    inside, outside = off[kept].max(axis=0) <= 35.3, off[~kept].min(axis=0, initial=180) >= 34.7
    assert (inside & outside).any()
