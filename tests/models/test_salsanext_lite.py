"""The variant of SalsaNext that folds: it computes on images of any size, and really folds."""

from collections import Counter
from functools import partial
from pathlib import Path

import onnx
import onnxruntime
import pytest
import torch
from torch import Tensor, nn

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export import onnx_file
from derain.export.onnx_file import export
from derain.models.layers.batch_norm import PixelBatchNorm
from derain.models.salsanext_lite import SalsaNextLite, SalsaNextLiteNetwork
from derain.scan import Scan
from derain.sources.frame import MemoryFrame

from .conftest import randomise


def small(channels: int = 5, width: int = 4, classes: int = 2) -> SalsaNextLiteNetwork:
    """A network with weights and statistics that leave no BatchNorm without effect."""
    network = SalsaNextLiteNetwork(channels, width, classes)
    randomise(network, seed=0)
    return network.eval()


def image(height: int, width: int, channels: int = 5) -> Tensor:
    generator = torch.Generator().manual_seed(height * 1000 + width)
    return torch.randn(1, channels, height, width, generator=generator)


@pytest.mark.parametrize("width", [-2, 0])
def test_a_width_of_nothing_is_refused(width) -> None:
    with pytest.raises(InputError, match=f"width: {width} is not positive"):
        SalsaNextLiteNetwork(width=width)


@torch.no_grad()
def test_folded_it_computes_the_same_without_a_batch_norm() -> None:
    network, seen = small(width=8), image(32, 64)
    kept = {name: tensor.clone() for name, tensor in network.state_dict().items()}
    folded = network.folded()
    assert not any(isinstance(layer, PixelBatchNorm) for layer in folded.modules())
    torch.testing.assert_close(folded(seen), network(seen), rtol=1e-4, atol=1e-5)
    # The one that goes on being trained is left as it was.
    assert network.state_dict().keys() == kept.keys()
    assert all(torch.equal(network.state_dict()[name], kept[name]) for name in kept)


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


@pytest.fixture
def exported(random_salsanext_lite, made_once) -> Path:
    """The network in float32, as an ONNX file."""
    return made_once("salsanext_lite.onnx", partial(export, random_salsanext_lite))


def convolutions(model: SalsaNextLite) -> int:
    return sum(isinstance(layer, nn.Conv2d) for layer in model.network.modules())


def test_the_exported_graph_has_its_convolutions_and_no_batch_norm(
    random_salsanext_lite, exported, tmp_path
) -> None:
    found = operators(exported)
    assert found["Conv"] == convolutions(random_salsanext_lite)
    assert not found.keys() & {"BatchNormalization", "DepthToSpace"}
    # Every ReLU is part of the convolution before it, or of the sum that it ends in.
    run = optimised(exported, tmp_path)
    assert run["Conv"] + run["FusedConv"] == found["Conv"]
    assert run["Relu"] <= found["Add"]


def test_in_eight_bits_nothing_leaves_the_integers_between_image_and_scores(
    random_salsanext_lite, exported, tmp_path, monkeypatch
) -> None:
    scenes = [Scan.of(scene(3000, seed), f"scene {seed}") for seed in range(2)]
    monkeypatch.setattr(onnx_file, "_traced", lambda *_: onnx.load(exported))
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: [("a scene", scenes[0])])
    frames = [MemoryFrame(key=scan.name, scan=scan) for scan in scenes]
    assert export(random_salsanext_lite, tmp_path / "int8.onnx", frames).holds
    run = optimised(tmp_path / "int8.onnx", tmp_path)
    assert run["QLinearConv"] == convolutions(random_salsanext_lite)
    assert run["QuantizeLinear"] == run["DequantizeLinear"] == 1
    assert not run.keys() & {"Conv", "FusedConv", "Relu", "Add", "Concat"}
