"""Candidates are the points within all bounds, and are read back as they were written."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.errors import InputError
from derain.files.documents import Entry
from derain.scan import Scan
from derain.views.candidates import Bound, Candidates, bounded_channels, candidates_at, narrower

numbers = st.none() | st.floats(-50, 50, width=32)
sides = (
    st.tuples(numbers, numbers)
    .filter(lambda pair: pair != (None, None))
    .map(lambda pair: pair if None in pair else tuple(sorted(pair)))
)
bounds = st.builds(
    lambda channel, pair: Bound(channel, *pair),
    st.sampled_from(["range", "z", "intensity", "doppler"]),
    sides,
)
rules = st.lists(bounds, min_size=1, unique_by=lambda bound: bound.channel).map(
    lambda several: Candidates(tuple(several), 0.25, 0.5, 0.75)
)


def a_scan(seed: int, intensity: bool) -> Scan:
    """A scan whose speeds are not known of every point."""
    generator = np.random.default_rng(seed)
    points = generator.uniform(-40, 40, (60, 4 if intensity else 3))
    doppler = np.where(generator.random(60) < 0.3, np.nan, generator.uniform(-40, 40, 60))
    scan = Scan.of(points)
    return Scan(scan.xyz, scan.intensity, fields={"doppler": doppler.astype(np.float32)})


@given(rules, st.integers(0, 1000), st.booleans())
def test_candidates_are_what_no_bound_leaves_out(candidates, seed, intensity) -> None:
    scan = a_scan(seed, intensity)
    expected = []
    for row in range(len(scan)):
        inside = True
        for bound in candidates.bounds:
            channel = scan.channel(bound.channel)
            value = None if channel is None else float(channel[row])
            if value is None or np.isnan(value):
                continue  # what is not known leaves nothing out
            inside &= bound.least is None or value >= bound.least
            inside &= bound.most is None or value <= bound.most
        expected.append(inside)
    assert candidates.among(scan).tolist() == expected


@given(rules)
def test_candidates_survive_json_and_print_each_of_their_numbers(candidates) -> None:
    content = [{"channel": b.channel, "least": b.least, "most": b.most} for b in candidates.bounds]
    document = {"bounds": content, "points": 0.25, "rain": 0.5, "rain_share": 0.75}
    assert candidates_at(Entry("model", "", json.loads(json.dumps(document)))) == candidates
    text = str(candidates)
    assert "25.0% of the points" in text
    for bound in candidates.bounds:
        assert all(f"{limit:g}" in text for limit in (bound.least, bound.most) if limit is not None)


@given(rules, rules, st.integers(0, 1000))
def test_the_narrower_bounds_hold_what_both_hold(some, others, seed) -> None:
    scan = a_scan(seed, intensity=True)
    both = Candidates(narrower(some.bounds, others.bounds))
    np.testing.assert_array_equal(both.among(scan), some.among(scan) & others.among(scan))
    assert len({bound.channel for bound in both.bounds}) == len(both.bounds)


NEAR = {"channel": "range", "most": 30.0}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({}, "c: bounds is missing"),
        ({"bounds": []}, r"c\.bounds: it bounds no channel, or one twice"),
        ({"bounds": [NEAR, NEAR]}, r"c\.bounds: it bounds no channel, or one twice"),
        ({"bounds": [{"channel": "z"}]}, r"c\.bounds\[0\]: it has neither least nor most"),
        ({"bounds": [{"most": 1.0}]}, r"c\.bounds\[0\]: channel is missing"),
        ({"bounds": [{**NEAR, "most": "far"}]}, r"c\.bounds\[0\]\.most: 'far' is not a finite"),
        ({"bounds": [{**NEAR, "least": 31}]}, r"c\.bounds\[0\]: its least is more than its most"),
        ({"bounds": [NEAR], "rain": 1.5}, r"c\.rain: 1\.5 is not within 0 and 1"),
        ({"bounds": [NEAR], "sky": 0}, r"c\.sky: there is no such key"),
    ],
)
def test_what_does_not_describe_candidates_is_refused(content, message) -> None:
    with pytest.raises(InputError, match=message):
        candidates_at(Entry("model", "c", content))


def test_candidates_are_bounded_by_range_and_height_and_what_the_network_sees() -> None:
    assert bounded_channels(("x", "y", "z", "intensity")) == ("range", "z", "intensity")
    assert bounded_channels(("range", "doppler")) == ("range", "z", "doppler")
