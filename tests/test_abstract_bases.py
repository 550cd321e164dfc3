"""What lacks part of what its base demands is refused when it is made, not in the third hour."""

import pytest

from derain.datamodules.base import ScanDataModule
from derain.files.format import Format
from derain.filters.point_filter import PointFilter
from derain.filters.radius_filter import RadiusFilter
from derain.methods.recording_method import RecordingMethod
from derain.models.base import DerainingModule
from derain.models.published import Published
from derain.models.supervised import SupervisedModule
from derain.sources.method import Method
from derain.views.view import SeenScan, View

MODEL = ("view_for", "forward", "losses", "configure_optimizers")
METHOD = ("window", "waiting", "starts_anew", "push", "flush", "oddities", "as_dict")
DEMANDED = {
    Method: METHOD,
    RecordingMethod: (*METHOD, "with_parameters"),
    DerainingModule: MODEL,
    SupervisedModule: tuple(name for name in MODEL if name != "losses"),
    Published: ("from_published",),
    View: ("of", "as_dict", "azimuth", "__call__"),
    SeenScan: ("size", "judged", "inputs", "target", "back_projection", "pack"),
    ScanDataModule: ("source",),
    Format: ("decode", "encode"),
    PointFilter: ("judge",),
    RadiusFilter: ("radius_at",),
}


@pytest.mark.parametrize(
    ("base", "missing"),
    [(base, name) for base, names in DEMANDED.items() for name in names],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_a_class_that_lacks_what_its_base_demands_is_refused(base: type, missing: str) -> None:
    written = {name: lambda *_: None for name in DEMANDED[base] if name != missing}
    incomplete = type("Incomplete", (base,), written)
    with pytest.raises(TypeError, match=rf"abstract class Incomplete .*\b{missing}\b"):
        incomplete()
