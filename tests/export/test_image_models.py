"""Networks on range images, exported: one image size, no torch, an answer for every row."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
import torch
from numpy.typing import NDArray

from derain import models
from derain.evaluation.hard_cases import hard_cases, scene
from derain.export.onnx_file import with_metadata
from derain.export.runtime import Derainer
from derain.models.base import DerainingModule
from derain.scan import Scan
from derain.views.probability import probability_of_rain
from derain.views.range_image import RangeView

HARD_CASES = dict(hard_cases(largest=5000))
PIXELS = 18 * 60


@pytest.fixture(scope="module")
def derainer(image_onnx: Path) -> Derainer:
    return Derainer(image_onnx, threads=1)


def shapes(path: Path) -> dict[str, list[int | str]]:
    graph = onnx.load(path).graph
    return {
        value.name: [size.dim_param or size.dim_value for size in value.type.tensor_type.shape.dim]
        for value in (*graph.input, *graph.output)
    }


def logits_of(model: DerainingModule, scan: Scan) -> NDArray[np.float32]:
    view = model.spec.make_view()(scan)
    with torch.inference_mode():
        return model(**{name: torch.from_numpy(a) for name, a in view.inputs().items()}).numpy()


def test_the_graph_is_of_its_opset_runs_fast_and_says_nothing_of_the_machine(
    image_onnx: Path, image_model: DerainingModule
) -> None:
    proto = onnx.load(image_onnx)
    onnx.checker.check_model(proto, full_check=True)
    assert [(opset.domain, opset.version) for opset in proto.opset_import] == [("", 18)]
    operators = {node.op_type for node in proto.graph.node}
    # Nothing depends on how many pixels are empty.
    assert {"Conv", "Where"} <= operators
    assert not operators & {"NonZero", "ScatterND", "ScatterElements", "Dropout"}
    # SalsaNext's follow an activation, so that they do not fold into the convolutions.
    assert ("BatchNormalization" in operators) == (image_model.NAME == "salsanext")
    attributes = [a for node in proto.graph.node if node.op_type == "Pad" for a in node.attribute]
    assert {a.s for a in attributes} <= {b"constant"}  # the checker lets opset 19's "wrap" pass
    assert not any(len(node.metadata_props) for node in proto.graph.node)
    assert str(Path(models.__file__).parent).encode() not in image_onnx.read_bytes()


def test_the_size_of_the_image_is_that_of_the_grid(
    image_onnx: Path, image_model: DerainingModule
) -> None:
    assert shapes(image_onnx) == {
        "image": [1, len(image_model.channels), 18, 60],
        "valid": [1, 1, 18, 60],
        "logits": [PIXELS, 2],
    }


def test_the_file_says_how_the_network_is_used(
    image_model: DerainingModule, derainer: Derainer
) -> None:
    assert derainer.spec == image_model.spec
    assert derainer.metadata["spec"] == image_model.spec.as_dict()
    assert derainer.view == image_model.spec.make_view()
    cases = derainer.metadata["proof"]["cases"]
    assert {case["points"] for case in cases} == {PIXELS}
    assert 0 < max(case["difference"] for case in cases) < 1e-4
    # What the other tests compare is worth comparing.
    assert 0.2 < derainer(scene()).mean() < 0.8


@pytest.mark.parametrize("scan", HARD_CASES.values(), ids=HARD_CASES)
def test_every_row_of_a_hard_scan_gets_the_answer_of_pytorch(
    image_model: DerainingModule, derainer: Derainer, scan: Scan
) -> None:
    probability = derainer.probability(scan)
    assert probability.shape == (len(scan),)
    assert probability.dtype == np.float32
    assert ((probability >= 0) & (probability <= 1)).all()
    assert not probability[~scan.valid].any()
    expected = probability_of_rain(logits_of(image_model, scan))
    back = image_model.spec.make_view()(scan).back(expected)
    np.testing.assert_allclose(probability, back, rtol=0, atol=1e-3)


def with_back_projection(
    derainer: Derainer, model: Path, back_projection: str, path: Path
) -> Derainer:
    """The same file, but for the back-projection in its Spec."""
    spec = replace(derainer.spec, view={**derainer.spec.view, "way_back": back_projection})
    proto = onnx.load(model)
    path.write_bytes(with_metadata(proto, {"spec": spec.as_dict()}))
    return Derainer(path, threads=1)


def test_the_way_back_is_the_specs_and_decides_for_what_lost_its_pixel_alone(
    image_model: DerainingModule, image_onnx: Path, derainer: Derainer, tmp_path: Path
) -> None:
    scan = Scan.of(scene())
    score = probability_of_rain(logits_of(image_model, scan))
    answers: dict[str, Any] = {}
    for back_projection in ("nearest range", "copy", "vote"):
        changed = with_back_projection(
            derainer, image_onnx, back_projection, tmp_path / "changed.onnx"
        )
        view = changed.view
        assert isinstance(view, RangeView)
        assert view.back_projection == back_projection
        answers[back_projection] = changed.probability(scan)
        np.testing.assert_allclose(
            answers[back_projection], view(scan).back(score), rtol=0, atol=1e-3
        )
    seen = view(scan)
    shown = (seen.pixel >= 0) & ~seen.hidden
    np.testing.assert_array_equal(answers["copy"][shown], answers["nearest range"][shown])
    np.testing.assert_array_equal(derainer.probability(scan), answers["nearest range"])
    for one, other in (("copy", "nearest range"), ("nearest range", "vote"), ("vote", "copy")):
        assert (answers[one][seen.hidden] != answers[other][seen.hidden]).any()


def test_points_outside_the_grid_are_no_rain_and_change_no_other(derainer: Derainer) -> None:
    points = scene(500)
    overhead = np.array([[0.1, 0, 50, 3], [0, 0.1, -50, 3]], np.float32)
    probability = derainer.probability(np.concatenate([overhead, points]))
    np.testing.assert_array_equal(probability[:2], 0)
    np.testing.assert_array_equal(probability[2:], derainer.probability(points))
