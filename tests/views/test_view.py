"""A view is found by its name and writes its own part of a Spec."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np
import pytest

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.files.documents import Entry
from derain.scan import Scan
from derain.spec import Spec
from derain.views.isolated_points import CHANNELS, IsolatedPointView
from derain.views.neighbours import Neighbourhoods, NeighbourView
from derain.views.range_image import RangeView
from derain.views.spherical_grid import ALL_AROUND, grid_of
from derain.views.view import VIEWS, View

from ..test_spec import SPEC

OURS = {
    "isolated_points": IsolatedPointView(5),
    "neighbours": NeighbourView(5),
    "range": RangeView(grid_of("wads", "test")),
}


def test_derain_has_these_views_and_each_knows_its_name() -> None:
    assert dict(VIEWS) == {name: type(view) for name, view in OURS.items()}
    assert {view.NAME for view in OURS.values()} == OURS.keys()


@pytest.mark.parametrize("view", OURS.values(), ids=OURS.keys())
def test_a_view_reads_back_what_it_writes(view) -> None:
    channels, fill_value = ("z", "range"), {"z": 1.5}
    entry = Entry("model", "view", view.as_dict())
    assert entry.value["kind"] == view.NAME
    if isinstance(view, IsolatedPointView):
        channels, expected = CHANNELS, replace(view, threads=3)
    else:
        expected = replace(view, channels=channels, fill_value=fill_value)
    if isinstance(view, NeighbourView):
        expected = replace(expected, threads=3)
    assert type(view).of(entry, channels, fill_value, threads=3) == expected


@pytest.fixture
def registered() -> Iterator[type[View]]:
    """A view of another package, known to derain for one test."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(VIEWS, "_members", dict(VIEWS))
        yield VIEWS.add("height")(HeightView)


@dataclass(frozen=True)
class HeightView(View):
    """Sees a point's neighbours, and as its one channel the height above the lowest point."""

    channels: tuple[str, ...] = ("height",)
    fill_value: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(
        cls, entry: Entry, channels: tuple[str, ...], fill_value: Mapping[str, float], threads: int
    ) -> Self:
        entry.record({"kind": Entry.text})
        return cls(channels, fill_value)

    def as_dict(self) -> dict[str, Any]:
        return {"kind": self.NAME}

    def __call__(self, scan: Scan) -> Neighbourhoods:
        seen = NeighbourView(2, ("z",))(scan)
        return replace(seen, points=seen.points - seen.points.min())


def spec_seen_through(view: Mapping[str, Any]) -> Spec:
    one = {"channels": ("height",), "units": ("m",), "mean": (0.0,), "std": (1.0,)}
    return replace(SPEC, view=view, **one)


def test_a_view_of_another_package_stands_in_a_spec(registered) -> None:
    spec = spec_seen_through(registered().as_dict())
    view = Spec.from_dict(spec.as_dict(), "model").make_view()
    assert isinstance(view, registered)
    scan = Scan.of(scene(50))
    seen = view(scan)
    height = scan.xyz[seen.first, 2] - scan.xyz[:, 2].min()
    np.testing.assert_array_equal(seen.inputs()["points"][:, 0], height)
    assert view.azimuth == ALL_AROUND


@pytest.mark.parametrize("view", OURS.values(), ids=OURS.keys())
def test_a_model_file_that_asks_for_scans_around_one_is_refused(view) -> None:
    asked = {**view.as_dict(), "window": {"before": 1, "after": 0}}
    with pytest.raises(InputError, match=r"view\.window: there is no such key"):
        replace(SPEC, view=asked).make_view()


def test_without_the_package_its_spec_is_refused() -> None:
    spec = spec_seen_through({"kind": "height"})
    with pytest.raises(InputError, match=r"view\.kind: unknown view 'height'\. Upgrade derain"):
        spec.make_view()
