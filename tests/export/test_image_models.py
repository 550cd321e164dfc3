"""Networks on range images, exported in float32 and in eight bits: one size, proved, no torch.

That each of them gives PyTorch's logits is proved when it is exported, for `tests/examples`; here
they are one, the one with most operators in eight bits.
"""

import weakref
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
from torch import nn

from derain import models
from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.export import onnx_file
from derain.export.onnx_file import export
from derain.export.proof import FINITE, INT8, THREADS, Proof
from derain.export.quantisation import CalibrationReader, quantised
from derain.export.runtime import Derainer
from derain.scan import Scan
from derain.sources.frame import Frame, MemoryFrame
from derain.sources.source import Frames
from derain.views.view import View

from .conftest import shapes_of

PIXELS = 18 * 60
CALIBRATION = Frames.of_scans([Scan.of(scene(3000, n), f"scene {n}") for n in range(3)])

pytestmark = pytest.mark.parametrize("image_model", ["salsanext_lite"], indirect=True)


@pytest.fixture(scope="module")
def int8(image_model, image_onnx, tmp_path_factory) -> tuple[Path, Proof]:
    """The network in eight bits, of the graph in float32, and the proof that the export gave."""
    path = tmp_path_factory.mktemp("int8") / "int8.onnx"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(onnx_file, "_traced", lambda *_: onnx.load(image_onnx))
        return path, export(image_model, path, CALIBRATION)


@pytest.fixture
def convolutions(image_model) -> int:
    """How many the network has."""
    return sum(isinstance(layer, nn.Conv2d) for layer in image_model.network.modules())


def test_the_graph_is_of_one_size_and_holds_nothing_of_the_machine(image_model, image_onnx) -> None:
    proto = onnx.load(image_onnx)
    operators = {node.op_type for node in proto.graph.node}
    # Nothing depends on how many pixels are empty.
    assert {"Conv", "Where"} <= operators
    assert not operators & {"NonZero", "ScatterND", "ScatterElements", "Dropout"}
    attributes = [a for node in proto.graph.node if node.op_type == "Pad" for a in node.attribute]
    assert {a.s for a in attributes} <= {b"constant"}  # the checker lets opset 19's "wrap" pass
    assert not any(len(node.metadata_props) for node in proto.graph.node)
    assert str(Path(models.__file__).parent).encode() not in image_onnx.read_bytes()
    assert shapes_of(image_onnx) == {
        "image": [1, len(image_model.channels), 18, 60],
        "valid": [1, 1, 18, 60],
        "logits": [PIXELS, 2],
    }


def operators(path: Path) -> Counter[str]:
    return Counter(node.op_type for node in onnx.load(path).graph.node)


def optimised(path: Path, folder: Path) -> Counter[str]:
    """Operators that onnxruntime runs, but for what it does for one kind of processor alone."""
    options = onnxruntime.SessionOptions()
    options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_ENABLE_EXTENDED
    options.optimized_model_filepath = str(folder / "optimised.onnx")
    options.log_severity_level = 3
    onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    return operators(folder / "optimised.onnx")


def test_the_graph_has_its_convolutions_and_no_batch_norm(
    image_onnx, convolutions, tmp_path
) -> None:
    found = operators(image_onnx)
    assert found["Conv"] == convolutions
    assert not found.keys() & {"BatchNormalization", "DepthToSpace"}
    # Every ReLU is part of the convolution before it, or of the sum that it ends in.
    run = optimised(image_onnx, tmp_path)
    assert run["Conv"] + run["FusedConv"] == found["Conv"]
    assert run["Relu"] <= found["Add"]


def test_in_eight_bits_nothing_leaves_the_integers_between_image_and_scores(
    int8, convolutions, tmp_path
) -> None:
    run = optimised(int8[0], tmp_path)
    assert run["QLinearConv"] == convolutions
    assert run["QuantizeLinear"] == run["DequantizeLinear"] == 1
    assert not run.keys() & {"Conv", "FusedConv", "Relu", "Add", "Concat"}


def test_onnxruntime_has_nothing_to_say_about_a_graph_that_is_ready(
    image_model, image_onnx, caplog
) -> None:
    view = image_model.spec.make_view()
    quantised(onnx.load(image_onnx), view, CALIBRATION[:1], image_model.INTEGER_OPERATORS)
    assert not caplog.records


def test_the_proof_is_made_on_the_calibration_scans_and_on_every_hard_case(int8) -> None:
    path, proof = int8
    assert proof.holds
    names = [frame.name for frame in CALIBRATION] + [name for name, _ in hard_cases()]
    assert [(case.name, case.threads) for case in proof.cases] == [
        (name, threads) for name in names for threads in THREADS
    ]
    seen, others = np.split(np.array(proof.cases), [len(CALIBRATION) * len(THREADS)])
    assert {case.bounds for case in seen} == {INT8}
    assert {case.bounds for case in others} == {FINITE}
    written = Derainer(path).metadata["proof"]
    assert written == proof.as_dict()
    assert written["cases"][0]["bounds"] == {"difference": None, "flipped": None, "rain_iou": 0.7}
    both, either = np.sum([(case.both, case.either) for case in seen], axis=0)
    assert 0.7 < written["rain_iou"] == both / either < 1  # it does compute in eight bits


def test_a_model_that_finds_no_rain_any_more_leaves_no_file(
    image_model, image_onnx, tmp_path, monkeypatch
) -> None:
    def blind(proto: onnx.ModelProto, *_: object) -> onnx.ModelProto:
        """Takes so much from every score of rain that none is left."""
        (logits,) = proto.graph.output
        for node in proto.graph.node:
            node.output[:] = ["seeing" if name == logits.name else name for name in node.output]
        loss = onnx.numpy_helper.from_array(np.array([0, -1e3], np.float32), "loss")
        proto.graph.initializer.append(loss)
        proto.graph.node.append(onnx.helper.make_node("Add", ["seeing", "loss"], [logits.name]))
        return proto

    monkeypatch.setattr(onnx_file, "_traced", lambda *_: onnx.load(image_onnx))
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: [])
    monkeypatch.setattr(onnx_file, "quantised", blind)
    with pytest.raises(InputError, match=r"FAILED: the IoU of the rain must be 0\.7"):
        export(image_model, tmp_path / "blind.onnx", CALIBRATION)
    assert list(tmp_path.iterdir()) == []


def test_one_calibration_scan_is_held_at_a_time(
    image_model, image_onnx, tmp_path, monkeypatch
) -> None:
    held: weakref.WeakSet[Scan] = weakref.WeakSet()
    read: list[tuple[str, int]] = []

    def counted(frame: MemoryFrame) -> Scan:
        read.append((frame.name, len(held)))
        scan = Scan.of(scene(500), frame.name)
        held.add(scan)
        return scan

    def gone_through(
        proto: onnx.ModelProto, view: View, frames: Sequence[Frame], *_: object
    ) -> onnx.ModelProto:
        reader = CalibrationReader(view, frames)
        while reader.get_next() is not None:
            pass
        return proto

    monkeypatch.setattr(MemoryFrame, "read", counted)
    monkeypatch.setattr(onnx_file, "_traced", lambda *_: onnx.load(image_onnx))
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: [])
    monkeypatch.setattr(onnx_file, "quantised", gone_through)
    assert export(image_model, tmp_path / "model.onnx", CALIBRATION).holds
    # Once to be scaled by, and once to be proved on; none while another is held.
    assert read == [(frame.name, 0) for frame in (*CALIBRATION, *CALIBRATION)]
