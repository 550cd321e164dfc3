"""OpenVINO gives onnxruntime's answers in float32, and nearly so in bfloat16; it stays at home.

`make test-openvino` installs it and runs these tests.
"""

import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import helper

from derain.default import default_checkpoint, default_model
from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.export.model_file import METADATA_KEY
from derain.export.proof import BF16, FLOAT32, prove
from derain.export.runtime import Derainer
from derain.export.runtimes.session import Runtime
from derain.models.checkpoint import load_model
from derain.scan import Scan
from derain.system.cores import usable_cores

KEPT = Path(__file__).parent.parent / "kept"
HARD_CASES = dict(hard_cases(largest=3000))
OPENVINO, BFLOAT16 = Runtime("openvino"), Runtime("openvino", "bf16")

pytestmark = pytest.mark.skipif(
    find_spec("openvino") is None, reason="OpenVINO is not installed: make test-openvino"
)


@pytest.fixture(scope="module")
def model() -> Derainer:
    return Derainer(KEPT / "outdet.onnx", 2, "openvino")


@pytest.fixture(scope="module")
def model_in_bfloat16() -> Derainer:
    try:
        return Derainer(KEPT / "outdet.onnx", 2, "openvino", "bf16")
    except InputError as error:
        pytest.skip(str(error))


MODELS = {
    "outdet": (KEPT / "outdet.ckpt", KEPT / "outdet.onnx"),
    "default": (default_checkpoint(), default_model()),
}


@pytest.mark.parametrize("name", MODELS)
def test_float32_is_onnxruntimes_on_every_hard_case(name) -> None:
    checkpoint, model = MODELS[name]
    found = prove(load_model(checkpoint), model, HARD_CASES.items(), FLOAT32, OPENVINO)
    assert found.holds, str(found)
    assert {case.runtime for case in found.cases} == {"openvino"}
    assert found.flipped == 0


@pytest.mark.usefixtures("model_in_bfloat16")
def test_bfloat16_is_near_on_every_hard_case() -> None:
    network = load_model(KEPT / "outdet.ckpt")
    found = prove(network, KEPT / "outdet.onnx", HARD_CASES.items(), BF16, BFLOAT16)
    assert found.holds, str(found)
    assert found.worst.difference > 1e-4  # it does compute in bfloat16
    assert str(found).startswith("openvino bf16: ")


def test_one_model_serves_several_threads_of_a_program(model) -> None:
    views = [model.view(Scan.of(scene(2000, seed))) for seed in range(8)]
    expected = [model.logits(view) for view in views]
    with ThreadPoolExecutor(4) as pool:
        for logits, alone in zip(pool.map(model.logits, views * 5), expected * 5, strict=True):
            np.testing.assert_array_equal(logits, alone)


@pytest.mark.parametrize("threads", [1, 2])
def test_threads_and_precision_are_those_that_are_asked_for(threads) -> None:
    network = Derainer(KEPT / "outdet.onnx", threads, "openvino").session.model
    assert network.get_property("INFERENCE_NUM_THREADS") == min(threads, usable_cores())
    assert network.get_property("NUM_STREAMS") == 1
    # The default would be bfloat16 where the processor has it.
    assert network.get_property("INFERENCE_PRECISION_HINT").to_dtype() == np.float32


def test_a_graph_that_it_cannot_run_is_one_line(tmp_path) -> None:
    proto = onnx.load(KEPT / "outdet.onnx")
    proto.graph.node[0].op_type = "Unheard"
    onnx.save(proto, tmp_path / "odd.onnx")
    with pytest.raises(InputError, match=r"odd\.onnx: not an ONNX model that openvino") as refusal:
        Derainer(tmp_path / "odd.onnx", 1, "openvino")
    assert "\n" not in str(refusal.value)


def test_inputs_that_a_network_has_no_use_for_may_be_among_those_of_its_view(tmp_path) -> None:
    proto = onnx.load(KEPT / "outdet.onnx")
    weight = np.random.default_rng(0).normal(size=(4, 2)).astype(np.float32)
    del proto.graph.node[:], proto.graph.initializer[:]
    proto.graph.node.append(helper.make_node("MatMul", ["points", "weight"], ["logits"]))
    proto.graph.initializer.append(onnx.numpy_helper.from_array(weight, "weight"))
    metadata = {entry.key: entry.value for entry in proto.metadata_props}
    known = json.loads(metadata[METADATA_KEY])
    helper.set_model_props(proto, {METADATA_KEY: json.dumps({"spec": known["spec"]})})
    onnx.save(proto, tmp_path / "points.onnx")
    usual, other = (
        Derainer(tmp_path / "points.onnx", 1, name) for name in ("onnxruntime", "openvino")
    )
    view = usual.view(Scan.of(scene(100)))
    np.testing.assert_allclose(other.logits(view), usual.logits(view), rtol=1e-5, atol=1e-4)


def test_a_processor_without_bfloat16_is_warned_of(monkeypatch) -> None:
    # OpenVINO's own way to make little of a processor; read when it is loaded.
    monkeypatch.setenv("OV_CPU_MAX_ISA", "AVX2")
    code = "import sys; from derain.cli.main import main; sys.exit(main(sys.argv[1:]))"
    options = ["--out", "none", "--runtime", "openvino", "--precision", "bf16"]
    finished = subprocess.run(
        [sys.executable, "-c", code, "run", KEPT / "outdet.onnx", "none.bin", *options],
        capture_output=True,
        text=True,
    )
    assert finished.returncode == 2
    assert finished.stderr.startswith("derain: precision bf16: this processor has none")


def test_it_asks_nothing_of_the_network_writes_nothing_and_needs_no_onnxruntime(
    tmp_path, monkeypatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    script = """
import sys
events = []
def heard(event, arguments):
    if event in ("socket.connect", "socket.getaddrinfo", "socket.sendto"):
        events.append((event, arguments))
sys.addaudithook(heard)
sys.modules["onnxruntime"] = sys.modules["torch"] = None  # importing them is an error
from derain.export.runtime import Derainer
from derain.evaluation.hard_cases import scene
print(Derainer(sys.argv[1], 1, "openvino")(scene(300)).sum())
assert not events, events
assert "openvino_telemetry" not in sys.modules
"""
    finished = subprocess.run(
        [sys.executable, "-c", script, KEPT / "outdet.onnx"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
    )
    assert finished.returncode == 0, finished.stderr
    assert int(finished.stdout) == Derainer(KEPT / "outdet.onnx", 1)(scene(300)).sum()
    assert not list(tmp_path.iterdir())
