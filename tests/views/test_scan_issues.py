"""What is odd about a scan: missing, constant and mistaken intensities, and what lies outside."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from derain.cards.card import load_card
from derain.evaluation.baselines import IntensityRule
from derain.evaluation.hard_cases import scene
from derain.files import read_scan
from derain.filters import DROR, SSR, FilterDerainer
from derain.models.outdet import OutDet
from derain.scan import Scan
from derain.spec import Spec
from derain.views.scan_issues import (
    HEAVIEST_RAIN,
    MOST_OUTSIDE,
    intensity_in_places,
    left_out,
    much_removed,
    outside_view,
)


@pytest.fixture(scope="module")
def spec() -> Spec:
    """That of a network on the points of WADS, whose mean intensity is 9.88 of 0..255."""
    return OutDet().spec_for(load_card("wads"))


def with_intensity(values: float | np.ndarray, points: int = 300) -> Scan:
    xyzi = scene(points)
    xyzi[:, 3] = values
    return Scan.of(xyzi)


def kinds(scan, checker) -> list[str]:
    return [issue.kind for issue in checker.issues(scan)]


def test_an_ordinary_scan_is_not_odd(spec) -> None:
    for checker in (spec, SSR(), DROR(), IntensityRule(1.0, 20.0)):
        assert kinds(Scan.of(scene(300)), checker) == []


@pytest.mark.parametrize("value", [0.0, 7.0, 255.0, 65_535.0])
def test_one_intensity_everywhere_was_not_measured(spec, value) -> None:
    scan = with_intensity(value)
    (issue,) = spec.issues(scan)
    assert issue.kind.startswith("intensity not measured")
    assert issue.detail.endswith("replaced by the mean of WADS, 9.88")
    for checker in (SSR(), IntensityRule(1e6, 1e6)):
        assert kinds(scan, checker) == [issue.kind]
    assert kinds(scan, DROR()) == []  # it looks at places alone


def test_intensities_that_are_no_numbers_were_not_measured(spec) -> None:
    for values in (np.nan, np.resize([np.nan, np.inf, 1e9], 300)):
        (issue,) = spec.issues(with_intensity(values))
        assert issue.detail.startswith("intensity not measured")


def test_every_channel_that_is_missing_is_an_oddity_of_its_own(spec) -> None:
    seeing = replace(
        spec,
        channels=("intensity", "doppler"),
        units=("0..255", "m/s"),
        mean=(9.0, 2.0),
        std=(1, 1),
    )
    assert kinds(Scan(scene(300)[:, :3].copy()), seeing) == ["no intensity", "no doppler"]


@pytest.mark.parametrize(("full_scale", "unit"), [(1.0, "smaller"), (65_535.0, "larger")])
def test_intensities_of_another_unit_are_distinguished_from_a_bright_scene(
    spec, full_scale, unit
) -> None:
    # Bright enough for the means to be no farther apart than those of two scenes may be.
    shares = np.random.default_rng(0).beta(*((8, 4) if full_scale == 1 else (0.05, 20)), 3000)
    scan = with_intensity(np.maximum(shares, 0.01) * full_scale, 3000)
    for checker in (spec, SSR()):
        assert kinds(scan, checker) == [f"intensity of a {unit} unit"]
        assert kinds(scan.with_intensity_times(255 / full_scale), checker) == []


def test_real_scans_are_odd_only_where_their_intensities_are_shares(spec, shared) -> None:
    units = {
        "clean/kitti_hdl64.bin": ["intensity of a smaller unit"],
        "clean/kitti_front.bin": ["intensity of a smaller unit"],
        "clean/hesai_at128_front.pcd": ["no intensity"],
        "clean/ouster_os1_128.npz": [],
        "clean/pandaset_pandar64.pcd": [],
        "clean/velodyne_vlp16_dual.pcd": [],
        "snowykitti/velodyne/000000.bin": [],
        "wads/sample.bin": [],
    }
    scans = {name: read_scan(shared / "data" / name) for name in units}
    for checker in (spec, SSR()):
        assert {name: kinds(scan, checker) for name, scan in scans.items()} == units


def test_a_unit_that_is_not_stated_is_recognised_by_the_mean_alone(spec) -> None:
    unknown = replace(spec, units=("m", "m", "m", "not stated"))
    assert kinds(with_intensity(scene(300)[:, 3] / 255), unknown) == ["intensity of a smaller unit"]
    assert kinds(with_intensity(scene(300)[:, 3] * 2), unknown) == []


def test_a_scan_without_a_point_has_no_other_fault(spec) -> None:
    for points in (np.zeros((0, 4), np.float32), np.full((200, 4), np.nan, np.float32)):
        for checker in (spec, SSR(), DROR(), IntensityRule(1.0, 20.0)):
            assert {*kinds(Scan.of(points), checker)} <= {"almost empty"}
            assert {*kinds(Scan.of(points[:, :3]), checker)} <= {"almost empty"}
        assert list(outside_view(Scan.of(points), np.zeros(len(points), bool), spec.data)) == []


def test_points_outside_the_view_are_odd_where_they_are_many(spec) -> None:
    scan = Scan.of(scene(1000))
    few = np.arange(1000) >= 1000 * MOST_OUTSIDE
    assert list(outside_view(scan, few, spec.data)) == []
    (issue,) = outside_view(scan, np.arange(1000) >= 250, spec.data)
    assert issue.detail == "25% of the points lie outside the grid of WADS, and stay"


def test_more_than_twice_the_heaviest_rain_is_too_much() -> None:
    assert not list(much_removed(2 * HEAVIEST_RAIN))
    (issue,) = much_removed(0.36)
    assert issue.detail.startswith("36% of the points are called rain")


def test_any_header_may_state_that_parts_of_its_file_are_not_written() -> None:
    @dataclass(frozen=True)
    class Header:
        left_out: tuple[str, ...]

    scan = Scan.of(scene(9))
    (issue,) = left_out(replace(scan, header=Header(("edge", "material"))))
    assert issue.kind == "parts of the file that are not written"
    assert issue.detail == "the cleaned file is without its edge, material"
    for header in (Header(()), None, "of another format"):
        assert not list(left_out(replace(scan, header=header)))


def test_ssr_and_the_rule_find_nothing_where_intensity_was_not_measured() -> None:
    scan = with_intensity(0)
    assert not FilterDerainer(SSR(threshold=1e9))(scan).any()
    assert not IntensityRule(1e6, 1e6)(scan).any()
    assert IntensityRule(1e6, 1e6)(with_intensity(0, 99)).all()


@pytest.mark.parametrize(("judged", "result"), [(True, "judged without it"), (False, "stay")])
def test_intensity_that_is_missing_in_places_is_counted(judged, result) -> None:
    intensity = np.arange(300, dtype=np.float32)
    assert not list(intensity_in_places(with_intensity(intensity), np.ones(300, bool)))
    intensity[::3] = [np.nan, np.inf] * 50
    (issue,) = intensity_in_places(with_intensity(intensity), np.full(300, judged))
    assert "100 points" in issue.detail
    assert result in issue.detail
