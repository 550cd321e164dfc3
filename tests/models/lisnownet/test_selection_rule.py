"""The selection rule is fitted to scans alone, and is the published one where nothing is known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.files import read_scan
from derain.files.documents import Entry
from derain.models.lisnownet.selection_rule import SelectionRule, otsu
from derain.scan import Float32s, Scan

HARD_CASES = dict(hard_cases(largest=5000))


def bright(*intensities: float) -> Scan:
    """A scan of as many points straight ahead."""
    points = np.array([[5.0, 0, -1, intensity] for intensity in intensities])
    return Scan.of(points.reshape(-1, 4))


def on_rings(*rings: tuple[float, float]) -> Scan:
    """Rings of 100 points each, of a radius and a height."""
    azimuth = np.linspace(0, 2 * np.pi, 100, endpoint=False)
    xyz = [
        np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), 0 * azimuth + height], 1)
        for radius, height in rings
    ]
    return Scan.of(np.concatenate(xyz))


def test_without_scans_the_rule_is_the_published_one() -> None:
    # Published: residual 0.012 (0.008 for WADS), ground -1.8 m, intensity 2/255.
    assert SelectionRule.fitted({}, []) == SelectionRule(0.012, -1.8, 2 / 255, 0.0, 255.0)


WHOLE = SelectionRule().as_dict()


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ({name: value for name, value in WHOLE.items() if name != "near"}, "rule: near is missing"),
        ({**WHOLE, "residual": 0.0}, r"rule\.residual: 0 is not above 0"),
        ({**WHOLE, "full_scale": -255.0}, r"rule\.full_scale: -255 is not above 0"),
    ],
)
def test_a_rule_that_a_spec_cannot_mean_is_refused(content, reason) -> None:
    with pytest.raises(InputError, match=rf"^model: {reason}"):
        SelectionRule.of(Entry("model", "rule", content))


@pytest.mark.parametrize(
    ("intensities", "full_scale"),
    [
        ([[0.0, 0.25], [1.0]], 1.0),
        ([[0.0, 0.25], [1.01]], 255.0),
        ([[255.0], [0.5]], 255.0),
        ([[256.0], [0.5]], 65_535.0),
        ([[70_000.0]], 65_535.0),
        ([[-3.0, 0.0]], 1.0),
        ([[]], 255.0),
    ],
)
def test_the_full_scale_is_the_smallest_that_no_intensity_exceeds(intensities, full_scale) -> None:
    scans = [bright(*values) for values in intensities]
    assert SelectionRule.fitted({}, scans).full_scale == full_scale


def test_what_is_not_measured_does_not_change_the_full_scale() -> None:
    damaged = Scan.of(np.array([[5, 0, -1, 0.5], [np.nan, 0, 0, 900], [0, 0, 0, 900.0]]))
    assert SelectionRule.fitted({}, [damaged]).full_scale == 1.0
    without = Scan.of(scene()[:, :3])
    assert SelectionRule.fitted({}, [without]).full_scale == 255.0
    assert SelectionRule.fitted({}, [without, bright(0.5)]).full_scale == 1.0
    assert SelectionRule.fitted({}, [bright(np.nan)]).full_scale == 255.0
    assert SelectionRule.fitted({}, [bright(np.nan), bright(0.5)]).full_scale == 1.0


@pytest.mark.parametrize(
    ("rings", "ground"),
    [
        (((10, -2), (15, 3)), -1.6),
        (((2.9, -9), (10, -2)), -1.6),  # the vehicle itself
        (((20.1, -9), (10, -2)), -1.6),  # a valley far off
        (((5, -3), (10, -2)), -2.6),
        (((1, -2), (30, -2)), -1.8),  # no road in sight: as published
    ],
)
def test_the_ground_is_a_little_above_the_road(rings, ground) -> None:
    assert SelectionRule.fitted({}, [on_rings(*rings)]).ground == pytest.approx(ground)


def test_a_few_stray_returns_below_the_road_do_not_lower_it() -> None:
    points = np.tile([10.0, 0, -2, 0], (100, 1))
    points[:4, 2] = -30
    assert SelectionRule.fitted({}, [Scan.of(points)]).ground == pytest.approx(-1.6)


def test_the_ground_is_that_of_the_median_scan() -> None:
    scans = [on_rings((10, height)) for height in (-2.0, -7.0, -2.1, 5.0, -2.2)]
    assert SelectionRule.fitted({}, scans).ground == pytest.approx(-2.1 + 0.4)
    assert SelectionRule.fitted({}, [*scans, HARD_CASES["empty"]]).ground == pytest.approx(-1.7)


def test_what_is_stated_is_not_fitted() -> None:
    stated = {"ground": -0.7, "full_scale": 100.0, "residual": 0.1, "intensity": 0.5, "near": 2.5}
    assert SelectionRule.fitted(stated, [Scan.of(scene())]).as_dict() == stated
    one = SelectionRule.fitted({"near": 2.5}, [Scan.of(scene())])
    assert one == SelectionRule(near=2.5, ground=one.ground, full_scale=255.0)
    assert one.ground != -1.8


def two_groups(low: float, high: float, share: float = 0.1) -> Float32s:
    """Positive numbers about two values, ten times as high or low at most, and negative ones."""
    rng = np.random.default_rng(0)
    centre = np.where(rng.random(5000) < share, high, low)
    positive = centre * 10 ** rng.uniform(-1, 1, 5000)
    return np.concatenate([positive, -positive]).astype(np.float32)


@pytest.mark.parametrize(("low", "high"), [(1e-4, 1.0), (1e-7, 1.0), (3e-2, 300.0)])
@pytest.mark.parametrize("share", [0.02, 0.5])
def test_the_residual_parts_what_changed_from_what_did_not(low, high, share) -> None:
    rule = SelectionRule(near=2.5).with_residual_of(two_groups(low, high, share))
    assert 9.9 * low < rule.residual < high / 9.9
    assert rule == SelectionRule(residual=rule.residual, near=2.5)


@pytest.mark.parametrize(
    "products",
    [np.zeros(0), np.zeros(500), np.full(500, -1.0), np.geomspace(1e-6, 1, 99)],
    ids=["none", "zeros", "negative", "few"],
)
def test_too_few_changes_leave_the_residual_as_it_is(products) -> None:
    rule = SelectionRule(residual=0.05)
    assert rule.with_residual_of(products.astype(np.float32)) == rule


def test_a_residual_is_not_fitted_to_noise() -> None:
    assert SelectionRule().with_residual_of(two_groups(1e-9, 1e-6)).residual == 0.001


@pytest.mark.parametrize("value", [1e-30, 0.05, 1e30])
def test_a_residual_is_fitted_to_changes_that_are_all_the_same(value) -> None:
    rule = SelectionRule().with_residual_of(np.full(500, value, np.float32))
    assert np.isfinite(rule.residual)
    assert rule.residual >= 0.001


def test_an_unknown_constant_is_refused_with_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"rule: \['far', 'height'\] .*Available: \['residual'"):
        SelectionRule.fitted({"height": 1.0, "near": 2.5, "far": 9.0}, [])


@pytest.mark.parametrize("scan", HARD_CASES.values(), ids=HARD_CASES)
def test_every_hard_scan_gives_a_rule(scan) -> None:
    rule = SelectionRule.fitted({}, [scan])
    assert np.isfinite(list(rule.as_dict().values())).all()
    assert rule.full_scale in (1.0, 255.0, 65_535.0)


def test_the_rule_that_is_fitted_to_wads_is_the_published_one(shared) -> None:
    paths = sorted((shared / "data/wads/sequences/36").glob("*/*.bin"))
    rule = SelectionRule.fitted({"residual": 0.008}, [read_scan(path) for path in paths])
    assert rule.full_scale == 255
    assert rule.ground == pytest.approx(-1.8, abs=0.1)


@given(st.integers(0, 2**32))
def test_otsu_leaves_the_least_variance_within_two_groups(seed) -> None:
    rng = np.random.default_rng(seed)
    values = np.concatenate([rng.normal(0, 1, 60), rng.normal(rng.uniform(0, 8), 1, 40)])

    def within(threshold: float) -> float:
        groups = (values[values <= threshold], values[values > threshold])
        return sum(len(group) * group.var() for group in groups if len(group))

    edges = np.histogram(values, 256)[1][1:-1]
    # Bins round every value by half a bin.
    assert within(otsu(values)) <= min(map(within, edges)) * 1.05
