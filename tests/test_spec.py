"""A Spec says the same after a trip through a file, or what is wrong with the file."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.errors import InputError
from derain.neighbours import NeighbourView
from derain.range_image import RangeView
from derain.scan import Scan
from derain.spec import SCHEMA, Spec
from derain.spherical_grid import SphericalGrid
from derain.way_back import WAYS_BACK

SPEC = Spec(
    network="outdet",
    view={"kind": "neighbours", "neighbours": 7},
    mean=(1.0, 2.0, 3.0, 4.0),
    std=(5.0, 6.0, 7.0, 8.0),
    classes={0: "road", 3: "rain", 110: "snow"},
    rain=(3, 110),
    data="somewhere",
    licence="MIT",
    channels=("x", "y", "z", "intensity"),
    units=("m", "m", "m", "0..255"),
    rule={"threshold": 0.008},
    threshold=0.25,
)

MEANS = {"x": 1.0, "y": 2.0, "z": 3.0, "intensity": 4.0}

four_numbers = st.tuples(*[st.floats(-1e6, 1e6)] * 4)
specs = st.builds(
    Spec,
    network=st.text(),
    view=st.fixed_dictionaries({"kind": st.just("neighbours"), "neighbours": st.integers(1, 64)}),
    mean=four_numbers,
    std=four_numbers,
    classes=st.dictionaries(st.integers(0, 65535), st.text()),
    rain=st.lists(st.integers(0, 65535)).map(tuple),
    data=st.text(),
    licence=st.text(),
    channels=st.just(("x", "y", "z", "intensity")),
    units=st.tuples(*[st.text()] * 4),
    rule=st.dictionaries(st.text(), st.floats(-1e6, 1e6)),
    threshold=st.floats(0, 1),
)


@given(specs)
def test_a_spec_survives_json(spec: Spec) -> None:
    assert Spec.from_dict(json.loads(json.dumps(spec.as_dict())), "model") == spec


def test_a_spec_as_a_dict_is_primitives_only() -> None:
    content = SPEC.as_dict()
    assert json.loads(json.dumps(content)) == content


def test_a_spec_read_back_cannot_be_changed() -> None:
    spec = Spec.from_dict(SPEC.as_dict(), "model")
    assert {type(value) for value in (spec.mean, spec.std, spec.rain, spec.units)} == {tuple}
    with pytest.raises(AttributeError):
        spec.threshold = 0.9  # type: ignore[misc]


def test_what_a_later_derain_adds_within_the_schema_is_passed_over() -> None:
    assert Spec.from_dict({**SPEC.as_dict(), "sensor": "unheard of"}, "model") == SPEC


def test_a_newer_schema_asks_for_an_upgrade() -> None:
    newer = {"schema": SCHEMA + 1, "everything": "else may differ"}
    with pytest.raises(InputError, match=r"m\.onnx: its Spec has schema .* Upgrade derain\."):
        Spec.from_dict(newer, "m.onnx")


@pytest.mark.parametrize("name", SPEC.as_dict())
def test_a_spec_that_lacks_something_is_damaged(name: str) -> None:
    content = SPEC.as_dict()
    del content[name]
    with pytest.raises(InputError, match=rf"m\.onnx: its Spec is damaged \('{name}'\)"):
        Spec.from_dict(content, "m.onnx")


@pytest.mark.parametrize(
    "classes", [None, [], "rain", {"three": "rain"}], ids=["none", "list", "text", "no number"]
)
def test_classes_that_are_not_named_by_numbers_are_damage(classes: Any) -> None:
    with pytest.raises(InputError, match=r"m\.onnx: its Spec is damaged"):
        Spec.from_dict({**SPEC.as_dict(), "classes": classes}, "m.onnx")


@pytest.mark.parametrize("name", ["channels", "units", "mean", "std"])
def test_channels_that_lack_a_number_are_damage(name: str) -> None:
    content = SPEC.as_dict()
    content[name] = content[name][:-1]
    with pytest.raises(InputError, match=r"damaged \(channels, units, mean and std differ"):
        Spec.from_dict(content, "m.onnx")


def test_the_view_is_the_one_the_spec_names() -> None:
    view = SPEC.make_view(threads=2)
    assert view == NeighbourView(7, SPEC.channels, MEANS, threads=2)


GRID = SphericalGrid.of_beams([3.0, 1.5, -0.1, -24.9], columns=100, azimuth=(-60.0, 70.0))


def of_range_view(**changes: Any) -> Spec:
    view = {"kind": "range", "grid": GRID.as_dict(), "way_back": "vote", **changes}
    return replace(SPEC, network="salsanext", view=view, channels=("z", "x", "range", "intensity"))


@pytest.mark.parametrize("way_back", WAYS_BACK)
def test_a_range_view_survives_json_with_its_grid_and_way_back(way_back: str) -> None:
    spec = of_range_view(way_back=way_back)
    read = Spec.from_dict(json.loads(json.dumps(spec.as_dict())), "model")
    assert read == spec
    channels = ("z", "x", "range", "intensity")
    means = dict(zip(channels, SPEC.mean, strict=True))
    assert read.make_view() == RangeView(GRID, channels, way_back, means)


def test_what_a_scan_lacks_is_what_its_means_stand_in_for() -> None:
    spec = replace(SPEC, channels=("x", "intensity", "radar", "doppler"))
    xyz = np.ones((2, 3), np.float32)
    assert spec.missing_channels(Scan(xyz)) == {"intensity": 2.0, "radar": 3.0, "doppler": 4.0}
    gaps = Scan(xyz, np.ones(2, np.float32), fields={"Doppler": np.full(2, np.nan)})
    assert spec.missing_channels(gaps) == {"radar": 3.0}
    fused = replace(gaps, radar=np.array([False, True]))
    assert spec.missing_channels(fused) == {}


def test_a_network_that_sees_no_intensity_has_no_unit_of_it() -> None:
    spec = replace(SPEC, channels=("x", "y", "z", "range"))
    assert (spec.mean_intensity, spec.intensity_unit) == (0.0, "not used")
    assert (SPEC.mean_intensity, SPEC.intensity_unit) == (4.0, "0..255")


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"way_back": "guess"}, "no such way back: 'guess'"),
        ({"grid": {"columns": 8}}, "salsanext: not a grid"),
        ({"grid": None}, "salsanext: not a grid"),
    ],
)
def test_a_range_view_that_cannot_be_is_refused(change: dict[str, Any], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        of_range_view(**change).make_view()


def test_an_unknown_view_asks_for_an_upgrade() -> None:
    content = {**SPEC.as_dict(), "view": {"kind": "voxels"}}
    with pytest.raises(InputError, match=r"unknown view 'voxels'\. Upgrade derain\."):
        Spec.from_dict(content, "m.onnx").make_view()
