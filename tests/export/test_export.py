"""Export writes one whole ONNX file that has been proved, or none."""

from contextlib import nullcontext
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnx
import pytest
import torch
from torch import Tensor, nn

import derain
from derain.cards.card import load_card
from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.export import onnx_file
from derain.export.evaluation_mode import evaluation_on_cpu
from derain.export.onnx_file import export
from derain.export.proof import FINITE, FLOAT32, INT8, THREADS, Case, Proof, prove
from derain.export.runtime import Derainer
from derain.models.outdet import OutDet
from derain.scan import Scan

SCENE = [("scene", Scan.of(scene()))]


def test_the_file_holds_a_whole_network_for_any_number_of_points(
    onnx_model: Path, random_outdet: OutDet
) -> None:
    beside = {file.name for file in onnx_model.parent.glob(f"{onnx_model.name}*")}
    assert beside <= {onnx_model.name, f"{onnx_model.name}.lock"}
    proto = onnx.load(onnx_model, load_external_data=False)
    onnx.checker.check_model(proto, full_check=True)
    assert [(opset.domain, opset.version) for opset in proto.opset_import] == [("", 18)]
    assert not any(onnx.external_data_helper.uses_external_data(t) for t in proto.graph.initializer)
    stored = sum(onnx.numpy_helper.to_array(t).size for t in proto.graph.initializer)
    folded = sum(parameter.numel() for parameter in random_outdet.deployed().parameters())
    assert folded <= stored <= folded + 100
    operators = {node.op_type for node in proto.graph.node}
    assert "MatMul" in operators
    assert not operators & {"BatchNormalization", "Dropout"}
    shapes = {
        value.name: [size.dim_param or size.dim_value for size in value.type.tensor_type.shape.dim]
        for value in (*proto.graph.input, *proto.graph.output)
    }
    assert shapes == {
        "points": ["points", 4],
        "distances": ["points", 9],
        "neighbours": ["points", 9],
        "logits": ["points", 2],
    }


@pytest.mark.usefixtures("one_block")
def test_another_size_of_neighbourhood_is_exported_as_well(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: SCENE)
    model = OutDet(neighbours=3)
    model.adopt(model.spec_for(load_card("kitti")))
    export(model, tmp_path / "three.onnx")
    derainer = Derainer(tmp_path / "three.onnx")
    assert derainer.view.neighbours == 3
    assert derainer.probability(scene(100)).shape == (100,)


def test_the_metadata_says_how_the_model_is_used(onnx_model: Path, random_outdet: OutDet) -> None:
    derainer = Derainer(onnx_model)
    assert derainer.spec == random_outdet.spec
    assert derainer.metadata["spec"] == random_outdet.spec.as_dict()
    assert derainer.metadata["versions"]["derain"] == derain.__version__
    assert derainer.metadata["versions"]["torch"] == torch.__version__
    proto = onnx.load(onnx_model)
    properties = {entry.key: entry.value for entry in proto.metadata_props}
    assert properties["license"] == "network: MIT; training data: CC BY-NC-SA 4.0"
    assert properties["version"] == derain.__version__
    assert "outdet" in properties["description"]
    assert "WADS" in properties["description"]


def test_the_proof_in_the_file_is_that_of_every_hard_case(
    onnx_model: Path, random_outdet: OutDet
) -> None:
    written = Derainer(onnx_model).metadata["proof"]
    view = random_outdet.spec.make_view()
    judged = {name: len(view(scan).points) for name, scan in hard_cases()}
    assert [(case["name"], case["threads"]) for case in written["cases"]] == [
        (name, threads) for name in judged for threads in THREADS
    ]
    assert all(case["points"] == judged[case["name"]] for case in written["cases"])
    assert written["points"] == len(THREADS) * sum(judged.values())
    assert written["largest_difference"] == max(case["difference"] for case in written["cases"])
    assert written["flipped"] == sum(case["flipped"] for case in written["cases"])
    # A second proof comes to the same numbers.
    again = prove(random_outdet, onnx_model, hard_cases()).as_dict()
    for first, second in zip(written["cases"], again["cases"], strict=True):
        # What torch adds up in another order differs in the last digits.
        assert second == {**first, "difference": pytest.approx(first["difference"], abs=2e-6)}
    assert 0 < written["largest_difference"] < 1e-5


@pytest.mark.parametrize("offset", [1e-3, 0.5])
def test_a_difference_of_the_logits_is_found_to_its_size(
    onnx_model: Path, random_outdet: OutDet, offset: float
) -> None:
    def shifted(**inputs: Tensor) -> Tensor:
        return random_outdet(**inputs) + torch.tensor([0.0, offset])

    view = random_outdet.spec.make_view()(SCENE[0][1]).inputs()
    with torch.inference_mode():
        logits = shifted(**{name: torch.from_numpy(array) for name, array in view.items()}).numpy()
    proof = prove(shifted, onnx_model, SCENE)
    assert not proof.holds
    assert "FAILED scene" in str(proof)
    assert [case.threads for case in proof.cases] == [1, 2]
    for case in proof.cases:
        assert case.difference == pytest.approx(offset / max(1, np.abs(logits).max()), rel=1e-2)
    # The mask of the file is the truth that the shifted network is measured against.
    flipped = Derainer(onnx_model)(scene()) != (logits[:, 1] > logits[:, 0])[_rows(random_outdet)]
    assert {case.flipped for case in proof.cases} == {flipped.sum()}


def test_what_is_not_a_number_differs_as_much_as_can_be(
    onnx_model: Path, random_outdet: OutDet
) -> None:
    def partly_undefined(**inputs: Tensor) -> Tensor:
        logits = random_outdet(**inputs)
        logits[7] = torch.nan
        return logits

    proof = prove(partly_undefined, onnx_model, SCENE)
    assert not proof.holds
    assert proof.as_dict()["largest_difference"] == np.inf
    assert "largest logit difference inf" in str(proof)


def test_swapped_logits_flip_every_point(onnx_model: Path, random_outdet: OutDet) -> None:
    proof = prove(lambda **inputs: random_outdet(**inputs).flip(1), onnx_model, SCENE)
    assert {case.flipped for case in proof.cases} == {len(scene())}


@pytest.mark.parametrize(
    ("change", "holds"),
    [
        ({}, True),
        ({"difference": FLOAT32.difference}, True),
        ({"difference": 1.01 * FLOAT32.difference}, False),
        ({"difference": float("nan")}, False),
        ({"flipped": 2}, True),
        ({"flipped": 3}, False),
        ({"flipped": 1, "points": 1}, True),
        ({"flipped": 2, "points": 9_999}, False),
        ({"finite": False}, False),
        ({"points": 0}, True),
        ({"difference": 1e9, "flipped": 20_000, "bounds": FINITE}, True),
        ({"finite": False, "bounds": FINITE}, False),
        ({"finite": False, "bounds": INT8}, False),
    ],
)
def test_a_case_holds_within_its_bounds_only(change: dict[str, float], holds: bool) -> None:
    case = Case(
        "case", points=round(2 / FLOAT32.flipped), threads=1, difference=0, flipped=0, finite=True
    )
    assert replace(case, **change).holds == holds


@pytest.mark.parametrize(
    ("found", "holds"),
    [
        ([(70, 100)], True),
        ([(69, 100)], False),
        ([(0, 300)], False),
        ([(0, 10), (90, 100)], True),
        ([(90, 100), (0, 50)], False),
        ([(0, 0)], False),
    ],
    ids=str,
)
def test_in_eight_bits_seven_tenths_of_the_rain_is_found_alike(
    found: list[tuple[int, int]], holds: bool
) -> None:
    # Of 10,000 cells: what changes is no twentieth of them.
    cases = [
        Case("scan", 10_000, 1, 0.1, either - both, True, both, either, INT8)
        for both, either in found
    ]
    beside = Case("hard", 10_000, 1, 0.1, 0, True, both=0, either=5000, bounds=FINITE)
    proof = Proof((*cases, beside))
    assert proof.holds == holds
    assert ("FAILED: the IoU of the rain must be 0.7" in str(proof)) != holds
    pooled = [sum(column) for column in zip(*found, strict=True)]
    assert proof.as_dict()["rain_iou"] == (pooled[0] / pooled[1] if pooled[1] else None)
    assert ("IoU of the rain -" in str(proof)) != bool(pooled[1])


class SpoiltFarAway(nn.Module):
    """A network whose logits are off for points a kilometre away."""

    def __init__(self, network: nn.Module, offset: float) -> None:
        super().__init__()
        self.network, self.offset = network, offset

    def forward(self, points: Tensor, distances: Tensor, neighbours: Tensor) -> Tensor:
        logits = self.network(points, distances, neighbours)
        return torch.where(points.abs().amax(1, keepdim=True) > 1000, logits + self.offset, logits)


@pytest.fixture
def few_cases(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shortens the proof to a case that the spoilt network passes and one that it does not."""
    few = [case for case in hard_cases() if case[0] in ("intensity 0", "range 1e4 m")]
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: few)


@pytest.mark.usefixtures("few_cases", "one_block")
def test_no_file_stays_when_the_exported_network_is_wrong(
    tmp_path: Path, random_outdet: OutDet, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "model.onnx"
    spoilt = SpoiltFarAway(random_outdet.deployed(), offset=10)
    monkeypatch.setattr(random_outdet, "deployed", lambda: spoilt)
    with pytest.raises(InputError, match=r"differs: FAILED range 1e4 m.* 4 cases") as error:
        export(random_outdet, path)
    assert error.value.subject == path
    assert "intensity 0" not in error.value.reason
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("few_cases")
def test_an_older_file_stays_as_it_was_when_the_proof_fails(
    tmp_path: Path, random_outdet: OutDet, onnx_model: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "model.onnx"
    path.write_bytes(b"an older model")
    other = deepcopy(random_outdet)
    other.network.head.bias.data += torch.tensor([0.0, 0.01])
    monkeypatch.setattr(onnx_file, "_traced", lambda *_: onnx.load(onnx_model))
    with pytest.raises(InputError, match="differs: FAILED intensity 0"):
        export(other, path)
    assert [file.read_bytes() for file in tmp_path.iterdir()] == [b"an older model"]


def test_a_model_that_has_not_been_trained_is_not_exported(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="outdet: has not been trained"):
        export(OutDet(), tmp_path / "model.onnx")
    assert list(tmp_path.iterdir()) == []


def test_an_output_that_cannot_be_written_is_reported(
    tmp_path: Path, random_outdet: OutDet
) -> None:
    file = tmp_path / "file"
    file.write_text("in the way")
    with pytest.raises(InputError, match=r"model\.onnx: cannot be written"):
        export(random_outdet, file / "model.onnx")
    with pytest.raises(InputError, match="is not a file that can be replaced"):
        export(random_outdet, tmp_path)
    assert list(tmp_path.iterdir()) == [file]
    assert file.read_text() == "in the way"


@pytest.mark.usefixtures("one_block")
def test_numbers_too_small_to_count_are_set_to_0_and_the_proof_holds(
    tmp_path: Path, random_outdet: OutDet, few_cases: None
) -> None:
    model = deepcopy(random_outdet)
    subnormal, negligible, kept = 1e-40, -9e-21, 2e-20
    with torch.no_grad():
        # What is folded into the head's weights is nothing: they are exported as they are.
        model.network.head.weight[:, 0] = subnormal
        model.network.head.weight[0, 1] = negligible
        model.network.head.weight[1, 1] = kept
    proof = export(model, tmp_path / "model.onnx")
    assert proof.holds
    stored = np.concatenate(
        [
            np.ravel(onnx.numpy_helper.to_array(tensor)).astype(np.float64)
            for tensor in onnx.load(tmp_path / "model.onnx").graph.initializer
            if tensor.data_type == onnx.TensorProto.FLOAT
        ]
    )
    assert np.abs(stored[stored != 0]).min() == pytest.approx(kept)
    assert Derainer(tmp_path / "model.onnx").metadata["flushed"] == 3


def test_a_whole_number_of_0_is_left_alone() -> None:
    graph = onnx.helper.make_graph([], "graph", [], [])
    tensors = [np.array([0, 1]), np.array([True]), np.array([0.0, 1.0, 1e-30], np.float16)]
    tensors += [np.array([[1e-30, -0.0], [1.0, np.nan]]), np.array(1e-30, np.float32)]
    graph.initializer.extend(onnx.numpy_helper.from_array(t, str(i)) for i, t in enumerate(tensors))
    proto = onnx.helper.make_model(graph)
    assert onnx_file.flush_to_zero(proto) == 2
    found = [onnx.numpy_helper.to_array(tensor) for tensor in proto.graph.initializer]
    for before, after in zip(tensors, found, strict=True):
        assert (after.dtype, after.shape) == (before.dtype, before.shape)
        expected = np.where(before == 1e-30, 0, before) if before.dtype.kind == "f" else before
        np.testing.assert_array_equal(after, np.where(np.abs(expected) < 1e-20, 0, expected))


def _rows(model: OutDet) -> np.ndarray:
    """For every row of the scene, the point of the network that answers for it."""
    return model.spec.make_view()(SCENE[0][1]).inverse


@pytest.mark.parametrize("succeeds", [True, False])
def test_a_model_is_left_in_the_modes_that_it_was_in(
    random_outdet: OutDet,
    onnx_model: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    succeeds: bool,
) -> None:
    model = deepcopy(random_outdet).train()
    frozen = next(module for module in model.modules() if isinstance(module, nn.BatchNorm1d))
    frozen.eval()
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: SCENE)
    monkeypatch.setattr(onnx_file, "_traced", lambda *_: onnx.load(onnx_model))
    if not succeeds:
        monkeypatch.setattr(onnx_file, "flush_to_zero", lambda proto: 1 / 0)
    with nullcontext() if succeeds else pytest.raises(ZeroDivisionError):
        export(model, tmp_path / "model.onnx")
    assert [module for module in model.modules() if not module.training] == [frozen]


def test_a_model_is_taken_back_to_its_device(
    random_outdet: OutDet, monkeypatch: pytest.MonkeyPatch
) -> None:
    device, moved = torch.device("cuda:0"), list[torch.device]()
    monkeypatch.setattr(OutDet, "device", device)  # as if it were there
    monkeypatch.setattr(random_outdet, "to", moved.append)
    with evaluation_on_cpu(random_outdet):
        assert moved == []
    assert moved == [device]
