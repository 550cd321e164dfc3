"""Export writes one whole ONNX file that has been proved, or none."""

from contextlib import nullcontext
from copy import deepcopy
from dataclasses import replace

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
from derain.export.onnx_file import export
from derain.export.proof import FINITE, FLOAT32, INT8, Case, Proof, prove
from derain.export.runtime import Derainer
from derain.models.outdet import OutDet
from derain.scan import Scan

from .conftest import shapes_of

SCENE = [("scene", Scan.of(scene()))]


def test_the_file_holds_a_whole_network_and_how_it_is_used(onnx_model, random_outdet) -> None:
    beside = {file.name for file in onnx_model.parent.glob(f"{onnx_model.name}*")}
    assert beside <= {onnx_model.name, f"{onnx_model.name}.lock"}
    proto = onnx.load(onnx_model, load_external_data=False)
    onnx.checker.check_model(proto, full_check=True)
    assert [(opset.domain, opset.version) for opset in proto.opset_import] == [("", 18)]
    stored = sum(onnx.numpy_helper.to_array(t).size for t in proto.graph.initializer)
    folded = sum(parameter.numel() for parameter in random_outdet.deployed().parameters())
    assert folded <= stored <= folded + 100
    operators = {node.op_type for node in proto.graph.node}
    assert not operators & {"BatchNormalization", "Dropout"}
    assert shapes_of(onnx_model) == {
        "points": ["points", 4],
        "distances": ["points", 9],
        "neighbours": ["points", 9],
        "logits": ["points", 2],
    }
    derainer = Derainer(onnx_model)
    assert derainer.spec == random_outdet.spec
    assert derainer.metadata["versions"]["derain"] == derain.__version__
    properties = {entry.key: entry.value for entry in proto.metadata_props}
    assert properties["license"] == "network: MIT; training data: CC BY-NC-SA 4.0"
    assert properties["version"] == derain.__version__


@pytest.mark.parametrize("offset", [1e-3, 0.5])
def test_a_difference_of_the_logits_is_found_to_its_size(onnx_model, random_outdet, offset) -> None:
    def shifted(**inputs: Tensor) -> Tensor:
        return random_outdet(**inputs) + torch.tensor([0.0, offset])

    view = random_outdet.spec.make_view()(SCENE[0][1])
    with torch.inference_mode():
        tensors = {name: torch.from_numpy(array) for name, array in view.inputs().items()}
        logits = shifted(**tensors).numpy()
    proof = prove(shifted, onnx_model, SCENE)
    assert not proof.holds
    assert "FAILED scene" in str(proof)
    assert [case.threads for case in proof.cases] == [1, 2]
    for case in proof.cases:
        assert case.difference == pytest.approx(offset / max(1, np.abs(logits).max()), rel=1e-2)
    # The mask of the file is the truth that the shifted network is measured against.
    flipped = Derainer(onnx_model)(scene()) != (logits[:, 1] > logits[:, 0])[view.inverse]
    assert {case.flipped for case in proof.cases} == {flipped.sum()}


def test_what_is_not_a_number_differs_as_much_as_can_be(onnx_model, random_outdet) -> None:
    def partly_undefined(**inputs: Tensor) -> Tensor:
        logits = random_outdet(**inputs)
        logits[7] = torch.nan
        return logits

    proof = prove(partly_undefined, onnx_model, SCENE)
    assert not proof.holds
    assert proof.as_dict()["largest_difference"] == np.inf


@pytest.mark.parametrize(
    ("change", "holds"),
    [
        ({"difference": FLOAT32.difference}, True),
        ({"difference": 1.01 * FLOAT32.difference}, False),
        ({"difference": float("nan")}, False),
        ({"flipped": 2}, True),
        ({"flipped": 3}, False),
        ({"flipped": 1, "points": 1}, True),
        ({"flipped": 2, "points": 9_999}, False),
        ({"points": 0}, True),
        ({"difference": 1e9, "flipped": 20_000, "bounds": FINITE}, True),
        ({"finite": False, "bounds": FINITE}, False),
    ],
)
def test_a_case_holds_within_its_bounds_only(change, holds) -> None:
    case = Case(
        "case", points=round(2 / FLOAT32.flipped), threads=1, difference=0, flipped=0, finite=True
    )
    assert replace(case, **change).holds == holds


@pytest.mark.parametrize(
    ("found", "holds"),
    [
        ([(70, 100)], True),
        ([(69, 100)], False),
        ([(0, 10), (90, 100)], True),
        ([(90, 100), (0, 50)], False),
        ([(0, 0)], False),
    ],
    ids=str,
)
def test_in_eight_bits_seven_tenths_of_the_rain_is_found_alike(found, holds) -> None:
    # Of 10,000 cells: what changes is no twentieth of them.
    cases = [
        Case("scan", 10_000, 1, 0.1, either - both, True, both, either, INT8)
        for both, either in found
    ]
    beside = Case("hard", 10_000, 1, 0.1, 0, True, both=0, either=5000, bounds=FINITE)
    proof = Proof((*cases, beside))
    assert proof.holds == holds
    assert ("FAILED: the IoU of the rain must be 0.7" in str(proof)) != holds
    both, either = (sum(column) for column in zip(*found, strict=True))
    assert proof.as_dict()["rain_iou"] == (both / either if either else None)


class SpoiltFarAway(nn.Module):
    """A network whose logits are off for points a kilometre away."""

    def __init__(self, network: nn.Module, offset: float) -> None:
        super().__init__()
        self.network, self.offset = network, offset

    def forward(self, points: Tensor, distances: Tensor, neighbours: Tensor) -> Tensor:
        logits = self.network(points, distances, neighbours)
        return torch.where(points.abs().amax(1, keepdim=True) > 1000, logits + self.offset, logits)


@pytest.fixture
def few_cases(monkeypatch) -> None:
    """Shortens the proof to a case that the spoilt network passes and one that it does not."""
    few = [case for case in hard_cases() if case[0] in ("intensity 0", "range 1e4 m")]
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: few)


@pytest.mark.usefixtures("few_cases", "one_block")
def test_an_older_file_stays_as_it_was_when_the_exported_network_is_wrong(
    tmp_path, random_outdet, monkeypatch
) -> None:
    path = tmp_path / "model.onnx"
    path.write_bytes(b"an older model")
    spoilt = SpoiltFarAway(random_outdet.deployed(), offset=10)
    monkeypatch.setattr(random_outdet, "deployed", lambda: spoilt)
    with pytest.raises(InputError, match=r"differs: FAILED range 1e4 m.* 4 cases") as error:
        export(random_outdet, path)
    assert error.value.subject == path
    assert "intensity 0" not in error.value.reason
    assert [file.read_bytes() for file in tmp_path.iterdir()] == [b"an older model"]


def test_what_cannot_be_exported_leaves_nothing(tmp_path, random_outdet) -> None:
    with pytest.raises(InputError, match="outdet: has not been trained"):
        export(OutDet(), tmp_path / "model.onnx")
    with pytest.raises(InputError, match="is not a file that can be replaced"):
        export(random_outdet, str(tmp_path))  # a path may be a text
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("few_cases", "one_block")
def test_numbers_too_small_to_count_are_set_to_0_and_the_proof_holds(
    tmp_path, random_outdet
) -> None:
    model = deepcopy(random_outdet)
    subnormal, negligible, kept = 1e-40, -9e-21, 2e-20
    with torch.no_grad():
        # What is folded into the head's weights is nothing: they are exported as they are.
        model.network.head.weight[:, 0] = subnormal
        model.network.head.weight[0, 1] = negligible
        model.network.head.weight[1, 1] = kept
    assert export(model, tmp_path / "model.onnx").holds
    stored = np.concatenate(
        [
            np.ravel(onnx.numpy_helper.to_array(tensor)).astype(np.float64)
            for tensor in onnx.load(tmp_path / "model.onnx").graph.initializer
            if tensor.data_type == onnx.TensorProto.FLOAT
        ]
    )
    assert np.abs(stored[stored != 0]).min() == pytest.approx(kept)
    assert Derainer(tmp_path / "model.onnx").metadata["flushed"] == 3


@pytest.mark.parametrize("succeeds", [True, False])
def test_a_model_is_left_in_its_modes_and_on_its_device(
    random_outdet, onnx_model, tmp_path, monkeypatch, succeeds
) -> None:
    model, device, moved = deepcopy(random_outdet).train(), torch.device("cuda:0"), []
    frozen = next(module for module in model.modules() if isinstance(module, nn.BatchNorm1d))
    frozen.eval()

    def flushed(proto: onnx.ModelProto) -> int:
        assert not any(module.training for module in model.modules())
        assert moved == []
        return 0 if succeeds else 1 // 0

    monkeypatch.setattr(OutDet, "device", device)  # as if it were there
    monkeypatch.setattr(model, "to", moved.append)
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: SCENE)
    monkeypatch.setattr(onnx_file, "_traced", lambda *_: onnx.load(onnx_model))
    monkeypatch.setattr(onnx_file, "flush_to_zero", flushed)
    with nullcontext() if succeeds else pytest.raises(ZeroDivisionError):
        export(model, tmp_path / "model.onnx")
    assert [module for module in model.modules() if not module.training] == [frozen]
    assert moved == [device]


EXTRA = {"radar": (0.1, 0.3), "doppler": (-2.0, 3.0)}


def recorded(seed: int) -> Scan:
    """A scan with a radar's columns, of which some are not known."""
    generator, points = np.random.default_rng(seed), scene(1000, seed)
    columns = {name: generator.normal(*EXTRA[name], len(points)) for name in EXTRA}
    columns["doppler"][::3] = np.nan
    return replace(Scan.of(points), fields=columns)


@pytest.mark.usefixtures("one_block")
def test_further_channels_are_seen_and_proved_and_missing_ones_are_their_mean(
    tmp_path, monkeypatch
) -> None:
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: [("recorded", recorded(3))])
    torch.manual_seed(0)
    model = OutDet(channels=("x", "y", "z", "intensity", *EXTRA), neighbours=3).eval()
    wads = load_card("wads")
    model.adopt(model.spec_for(replace(wads, moments=wads.moments | EXTRA)))
    export(model, tmp_path / "model.onnx")
    derainer, scan = Derainer(tmp_path / "model.onnx", 1), recorded(7)
    assert derainer.view.neighbours == 3
    assert derainer.spec.units[-2:] == ("0 or 1", "m/s")
    means = {name: np.full(len(scan), mean) for name, (mean, _) in EXTRA.items()}
    absent, filled = (derainer.probability(replace(scan, fields=f)) for f in ({}, means))
    np.testing.assert_array_equal(absent, filled)
    assert (derainer.probability(scan) != absent).mean() > 0.1
    # A proof looks at them as well.
    graph = onnx.load(tmp_path / "model.onnx")
    monkeypatch.setattr(onnx_file, "_traced", lambda *_: graph)
    model.std[model.channels.index("doppler")] *= 2
    with pytest.raises(InputError, match="the exported model differs"):
        export(model, tmp_path / "other.onnx")
