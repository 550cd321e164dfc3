"""Models that examples are tried with."""

import shutil
import sys
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from itertools import product
from pathlib import Path
from types import ModuleType, SimpleNamespace

import onnx
import pytest

from derain.export.onnx_file import with_metadata
from derain.export.runtime import Derainer
from derain.views.back_projection import BACK_PROJECTIONS

from .cpp import Program, build, program
from .made_up_ros import EXAMPLE, DiagnosticArray, DiagnosticStatus, KeyValue, PointCloud2


@pytest.fixture(scope="session")
def built(made_once) -> Path:
    """The folder in which the example in C++ was built."""
    if missing := [tool for tool in ("cmake", "c++", "make") if shutil.which(tool) is None]:
        pytest.skip(f"no {' and no '.join(missing)} to build the example with")
    return made_once("examples_cpp", build)


@pytest.fixture(scope="session")
def show_view(built) -> Program:
    """Its program that needs no onnxruntime."""
    return program(built / "show_view")


@pytest.fixture(scope="session")
def derain_onnx(built) -> Program:
    """The one that does."""
    if not (built / "derain_onnx").exists():
        pytest.skip(
            "no headers of onnxruntime: apt install libonnxruntime-dev (Debian 13), or set "
            "ONNXRUNTIME_ROOT to an unpacked release"
        )
    return program(built / "derain_onnx")


@pytest.fixture(params=product(BACK_PROJECTIONS, [None, (-60.0, 75.0)], [True, False]), ids=str)
def model_of_images(request, salsanext_onnx, candidates, tmp_path) -> Path:
    """SalsaNext whose scores come back in every way, of a circle or a sector, of all or some."""
    way_back, sector, of_all = request.param
    spec = Derainer(salsanext_onnx).spec
    grid = {**spec.view["grid"], "azimuth": sector or (-180.0, 180.0)}
    view = {**spec.view, "grid": grid, "way_back": way_back}
    changed = replace(spec, view=view, candidates=None if of_all else candidates)
    path = tmp_path / "model.onnx"
    path.write_bytes(with_metadata(onnx.load(salsanext_onnx), {"spec": changed.as_dict()}))
    return path


@pytest.fixture(scope="module")
def ros2_node() -> Iterator[ModuleType]:
    """The example's module, imported where there is no rclpy."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(EXAMPLE)
        patch.setitem(sys.modules, "rclpy", None)  # whoever imports it fails
        yield import_module("derain_node")
        del sys.modules["derain_node"]


@pytest.fixture
def ros(monkeypatch) -> None:
    """Modules of ROS, as much of them as the example imports."""
    modules = {
        "rclpy": {},
        "rclpy.qos": {
            "QoSProfile": SimpleNamespace,
            "ReliabilityPolicy": SimpleNamespace(BEST_EFFORT="best effort", RELIABLE="reliable"),
        },
        "sensor_msgs": {},
        "sensor_msgs.msg": {"PointCloud2": PointCloud2},
        "diagnostic_msgs": {},
        "diagnostic_msgs.msg": {
            one.__name__: one for one in (DiagnosticArray, DiagnosticStatus, KeyValue)
        },
    }
    for name, members in modules.items():
        module = ModuleType(name)
        vars(module).update(members)
        monkeypatch.setitem(sys.modules, name, module)
