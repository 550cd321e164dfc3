"""A Spec is the same after a trip through a file, or the error names what is wrong."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.errors import InputError
from derain.scan import Scan
from derain.spec import SCHEMA, Spec
from derain.views.back_projection import BACK_PROJECTIONS
from derain.views.channels import MOST_CHANNELS
from derain.views.neighbours import MOST_NETWORK_NEIGHBOURS, NeighbourView
from derain.views.range_image import RangeView
from derain.views.spherical_grid import SphericalGrid

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

MEANS_OF = ("channels", "units", "mean", "std")

# A text may be the name of a file, in which the system allows no null character.
TEXTS = st.text(st.characters(exclude_characters="\0"))

four_numbers = st.tuples(*[st.floats(-1e6, 1e6)] * 4)
specs = st.builds(
    lambda classes, share, **parts: replace(
        SPEC, classes=classes, rain=tuple(sorted(classes)[: round(share * len(classes))]), **parts
    ),
    network=TEXTS,
    view=st.fixed_dictionaries(
        {"kind": st.just("neighbours"), "neighbours": st.integers(1, MOST_NETWORK_NEIGHBOURS)}
    ),
    mean=four_numbers,
    std=st.tuples(*[st.floats(1e-6, 1e6)] * 4),
    classes=st.dictionaries(st.integers(0, 65535), TEXTS),
    share=st.floats(0, 1),
    data=TEXTS,
    licence=TEXTS,
    units=st.tuples(*[TEXTS] * 4),
    rule=st.dictionaries(TEXTS, st.floats(-1e6, 1e6)),
    threshold=st.floats(0, 1),
    training=st.dictionaries(TEXTS, st.lists(TEXTS).map(tuple)),
)


@given(specs)
def test_a_spec_survives_json(spec) -> None:
    assert Spec.from_dict(json.loads(json.dumps(spec.as_dict())), "model") == spec


@pytest.mark.parametrize("schema", [SCHEMA + 1, 10**400], ids=["next", "far"])
def test_a_newer_schema_asks_for_an_upgrade(schema) -> None:
    newer = {**SPEC.as_dict(), "schema": schema}
    with pytest.raises(InputError, match=r"m\.onnx: its Spec: .*schema.* Upgrade derain"):
        Spec.from_dict(newer, "m.onnx")


DEFAULTS = {"rule": {}, "threshold": 0.5, "candidates": None, "training": {}, "schema": SCHEMA}


@pytest.mark.parametrize("name", SPEC.as_dict())
def test_what_has_a_default_may_be_missing_and_nothing_else(name) -> None:
    content = SPEC.as_dict()
    del content[name]
    if name in DEFAULTS:
        assert Spec.from_dict(content, "m.onnx") == replace(SPEC, **{name: DEFAULTS[name]})
    else:
        with pytest.raises(InputError, match=rf"m\.onnx: its Spec: {name} is missing"):
            Spec.from_dict(content, "m.onnx")


GRID = SphericalGrid.of_beams([3.0, 1.5, -0.1, -24.9], columns=100, azimuth=(-60.0, 70.0))


def of_range_view(**changes: Any) -> Spec:
    view = {"kind": "range", "grid": GRID.as_dict(), "way_back": "vote", **changes}
    return replace(SPEC, network="salsanext", view=view, channels=("z", "x", "range", "intensity"))


NAN, HUGE = float("nan"), 10**400


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        *(({"classes": wrong}, "classes") for wrong in (None, {"three": "r"}, {"65536": "r"})),
        *(({"rain": wrong}, "rain") for wrong in ([4], [-1], 3)),
        ({"std": [1, 2, 3, 0]}, r"std\[3\]"),
        *(({"mean": [wrong, 2, 3, 4]}, r"mean\[0\]") for wrong in (NAN, HUGE)),
        *(({"threshold": wrong}, "threshold") for wrong in (NAN, 1.1)),
        *(({"channels": wrong}, "channels") for wrong in ("xyzi", ["x"] * 4)),
        ({"channels": ["x"] * (MOST_CHANNELS + 1)}, "more than 64 channels"),
        ({"channels": ["x", "y", "z", "dual_return"]}, "Train it again without dual_return"),
        ({"channels": [], "units": [], "mean": [], "std": []}, "channels .* are none"),
        *(({name: [*SPEC.as_dict()[name]][:-1]}, "differ in number") for name in MEANS_OF),
        *(({"rule": wrong}, "rule") for wrong in (None, {"a": HUGE})),
        *(({"training": wrong}, "training") for wrong in ([], {"00": [1]})),
        *(({name: 3}, name) for name in ("network", "data", "licence")),
        *(({"schema": wrong}, "schema") for wrong in (0, "1", None, 1.0)),
        *(({"view": wrong}, "view") for wrong in (None, {}, {"kind": []})),
        ({"sensor": "of a later derain"}, "sensor: there is no such key"),
        ({"view": {"kind": "voxels"}}, "view.kind: unknown view 'voxels'"),
        ({"view": {"kind": "neighbours"}}, "view: neighbours is missing"),
        *(
            ({"view": {"kind": "neighbours", "neighbours": wrong}}, r"view\.neighbours")
            for wrong in (0, MOST_NETWORK_NEIGHBOURS + 1, HUGE, 9.0, True)
        ),
        ({"view": {"kind": "neighbours", "neighbours": 9, "k": 9}}, r"view\.k: there is no"),
        *(
            ({"view": of_range_view(**changes).view}, reason)
            for changes, reason in (
                ({"way_back": "guess"}, "no such back-projection: 'guess'"),
                ({"grid": {"columns": 10**9, "edges": [1.0, 0.0]}}, "grid.columns: 1000000000"),
                ({"grid": {"columns": 8, "edges": [1.0, HUGE]}}, r"view\.grid\.edges\[1\]"),
            )
        ),
    ],
    ids=str,
)
def test_a_value_that_cannot_be_is_refused_where_it_stands(change, reason) -> None:
    with pytest.raises(
        InputError, match=rf"m\.onnx: (its Spec|back_projection): .*{reason}"
    ) as refusal:
        Spec.from_dict({**SPEC.as_dict(), **change}, "m.onnx")
    assert len(str(refusal.value)) < 300
    if isinstance(view := change.get("view"), dict):
        with pytest.raises(InputError, match=reason):
            replace(SPEC, view=view).make_view()


@pytest.mark.parametrize("content", [None, [], "Spec", {1: 2}], ids=str)
def test_what_is_no_mapping_is_no_spec(content) -> None:
    with pytest.raises(InputError, match=r"m\.onnx: its Spec: "):
        Spec.from_dict(content, "m.onnx")


@pytest.mark.parametrize("way_back", BACK_PROJECTIONS)
def test_a_range_view_survives_json_with_its_grid_and_way_back(way_back) -> None:
    spec = of_range_view(way_back=way_back)
    read = Spec.from_dict(json.loads(json.dumps(spec.as_dict())), "model")
    assert read == spec
    means = dict(zip(spec.channels, SPEC.mean, strict=True))
    assert read.make_view() == RangeView(GRID, spec.channels, way_back, means)
    neighbours = NeighbourView(7, SPEC.channels, MEANS, threads=2)
    assert SPEC.make_view(threads=2) == neighbours


def test_what_a_scan_lacks_is_what_its_means_stand_in_for() -> None:
    spec = replace(SPEC, channels=("x", "intensity", "radar", "doppler"))
    xyz = np.ones((2, 3), np.float32)

    def replaced(scan: Scan) -> list[str]:
        found = (issue.detail for issue in spec.issues(scan))
        return [detail for detail in found if "replaced by the mean of somewhere" in detail]

    lacking = replaced(Scan(xyz))
    assert [detail.partition(":")[0] for detail in lacking] == [
        "no intensity",
        "no radar",
        "no doppler",
    ]
    assert [detail.rpartition(" ")[2] for detail in lacking] == ["2", "3", "4"]
    gaps = Scan(xyz, np.ones(2, np.float32), fields={"Doppler": np.full(2, np.nan)})
    assert len(replaced(gaps)) == 1
    assert replaced(replace(gaps, radar=np.array([False, True]))) == []
