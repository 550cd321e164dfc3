"""A model file is opened as it was exported and proved, or not at all."""

import json
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
import torch
from onnx import TensorProto, helper

from derain.default import default_model
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export import model_file
from derain.export.model_file import (
    CHECKSUM_KEY,
    METADATA_KEY,
    PARTS,
    ModelFile,
    number_of_weights,
)
from derain.export.onnx_file import with_metadata
from derain.export.runtime import Derainer

KEPT = Path(__file__).parent / "kept/outdet.onnx"
SPEC = ModelFile.read(KEPT).metadata["spec"]
DESCRIPTORS = {
    "model": onnx.ModelProto,
    "training": onnx.TrainingInfoProto,
    "function": onnx.FunctionProto,
    "graph": onnx.GraphProto,
    "node": onnx.NodeProto,
    "attribute": onnx.AttributeProto,
    "sparse tensor": onnx.SparseTensorProto,
    "tensor": onnx.TensorProto,
}


@pytest.fixture
def path(tmp_path) -> Path:
    return tmp_path / "model.onnx"


@pytest.fixture
def exported(path) -> bytes:
    """The kept model as it is exported today: with a checksum, and with all of a Spec."""
    file = ModelFile.read(KEPT)
    metadata = file.metadata | {"spec": file.spec.as_dict(), "flushed": 0}
    path.write_bytes(with_metadata(onnx.load(KEPT), metadata, version="0.1.0"))
    return path.read_bytes()


def test_a_flipped_bit_is_refused_or_changes_no_answer(exported, path) -> None:
    points = scene(50)
    answer = Derainer(path, threads=1).probability(points)
    rng = np.random.default_rng(0)
    # Anywhere, and then in the metadata, of which the file has less than of weights.
    start = exported.index(b'"spec"')
    bits = [
        *rng.integers(8 * len(exported), size=100),
        *rng.integers(8 * start, 8 * len(exported), size=50),
    ]
    refused = 0
    for bit in bits:
        flipped = bytearray(exported)
        flipped[bit // 8] ^= 1 << bit % 8
        path.write_bytes(flipped)
        try:
            derainer = Derainer(path, threads=1)
        except InputError:
            refused += 1
        else:
            np.testing.assert_array_equal(derainer.probability(points), answer, strict=True)
    assert refused > 0.98 * len(bits)
    for kept in (0, 10, 1000, len(exported) - 1):
        path.write_bytes(exported[:kept])
        with pytest.raises(InputError, match=r"model\.onnx: (not an ONNX model|it has no Spec)"):
            Derainer(path)


@pytest.mark.parametrize(
    "part", ["a weight", "the threshold", "the checksum", "no text", "a byte more"]
)
def test_a_file_that_is_not_as_it_was_exported_is_warned_of(exported, path, part) -> None:
    weights = max(onnx.load(KEPT).graph.initializer, key=lambda tensor: len(tensor.raw_data))
    changed = {
        "a weight": exported.replace(weights.raw_data[:64], weights.raw_data[1:65]),
        "the threshold": exported.replace(b'"threshold": 0.5', b'"threshold": 0.9'),
        "the checksum": exported.replace(json_checksum(exported), b"f" * 64),
        "no text": exported.replace(json_checksum(exported), rb"\ud800" + b"f" * 58),
        "a byte more": exported + b"\x0a\x00",
    }[part]
    assert changed != exported
    path.write_bytes(changed)
    with pytest.raises(InputError, match=r"model\.onnx: it is not as it was exported"):
        Derainer(path)


def without(metadata: dict[str, Any], *keys: str) -> dict[str, Any]:
    return {key: value for key, value in metadata.items() if key not in keys}


@pytest.mark.parametrize(
    "change",
    [
        lambda known: without(known, CHECKSUM_KEY),
        lambda known: {**without(known, CHECKSUM_KEY), "versions": {"derain": "0.1.0"}},
        lambda known: {"spec": known["spec"]},
        lambda known: {"spec": without(known["spec"], "candidates"), "proof": known["proof"]},
        lambda known: {"spec": without(known["spec"], "training"), "proof": known["proof"]},
    ],
    ids=["removed", "earlier", "the spec", "a part", "another part"],
)
def test_a_file_that_has_lost_its_checksum_is_refused(exported, path, change) -> None:
    proto = onnx.load_from_string(exported)
    metadata = json.dumps(change(ModelFile.read(path).metadata))
    helper.set_model_props(proto, {METADATA_KEY: metadata})
    onnx.save(proto, path)
    with pytest.raises(InputError, match=r"model\.onnx: it has no checksum"):
        ModelFile.read(path)


def json_checksum(content: bytes) -> bytes:
    place = content.index(f'"{CHECKSUM_KEY}": "'.encode()) + len(CHECKSUM_KEY) + 5
    return content[place : place + 64]


def holds_tensors(message: Any, seen: frozenset[str] = frozenset()) -> bool:
    name = message.full_name
    inner = [field.message_type for field in message.fields if field.message_type]
    return name == "onnx.TensorProto" or (
        name not in seen and any(holds_tensors(part, seen | {name}) for part in inner)
    )


@pytest.mark.parametrize("kind", DESCRIPTORS)
def test_the_table_of_parts_names_every_place_that_a_tensor_can_have(kind) -> None:
    kinds = {proto.DESCRIPTOR.full_name: kind for kind, proto in DESCRIPTORS.items()}
    holding = {
        field.number: kinds[field.message_type.full_name]
        for field in DESCRIPTORS[kind].DESCRIPTOR.fields
        if field.message_type and holds_tensors(field.message_type)
    }
    assert PARTS[kind] == holding


def elsewhere(name: str, location: Path) -> TensorProto:
    tensor = helper.make_tensor(name, TensorProto.FLOAT, [2], [1.0, 2.0])
    del tensor.float_data[:]
    tensor.data_location = TensorProto.EXTERNAL
    entry = tensor.external_data.add()
    entry.key, entry.value = "location", str(location)
    return tensor


def in_an_initializer(proto: onnx.ModelProto, tensor: TensorProto) -> None:
    proto.graph.initializer.append(tensor)


def in_a_branch(proto: onnx.ModelProto, tensor: TensorProto) -> None:
    branch = helper.make_graph([], "branch", [], [], initializer=[tensor])
    node = helper.make_node("If", ["logits"], ["either"], then_branch=branch, else_branch=branch)
    proto.graph.node.append(node)


@pytest.mark.parametrize("put", [in_an_initializer, in_a_branch])
def test_weights_in_another_file_are_refused_and_not_looked_for(
    path, tmp_path, monkeypatch, put
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "secret").write_bytes(bytes(8))
    proto = onnx.load(KEPT)
    put(proto, elsewhere("outside", Path("secret")))
    path.write_bytes(proto.SerializeToString())
    with pytest.raises(InputError, match=r"model\.onnx: its weights are in another file"):
        Derainer(path)


def with_text(text: bytes) -> bytes:
    """The kept model with other bytes for its metadata, which need be no text."""
    proto = onnx.load(KEPT)
    del proto.metadata_props[:]
    key = METADATA_KEY.encode()
    prop = b"\x0a" + bytes([len(key)]) + key + b"\x12" + varint(len(text)) + text
    return proto.SerializeToString() + b"\x72" + varint(len(prop)) + prop


def varint(number: int) -> bytes:
    most = [number >> shift & 0x7F | 0x80 for shift in range(0, 28, 7)]
    return bytes([*most, number >> 28])


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (b'{"spec": "\xff\xfe"}', "not an ONNX model .*utf-8"),
        (b"[" * 100_000, "not JSON"),
        (b'{"a": ' * 50 + b"1" + b"}" * 50, "not JSON .*nested more than"),
        (b"{" + b" " * 2**20 + b"}", "not JSON .*characters"),
        (b"{}", "it has no Spec"),
        (json.dumps({"spec": SPEC, CHECKSUM_KEY: "abc"}).encode(), "it is not as it was exported"),
        (json.dumps({"spec": SPEC | {"threshold": float("nan")}}).encode(), "threshold: nan"),
    ],
    ids=["bytes", "brackets", "nested", "long", "empty", "short", "nan"],
)
def test_metadata_that_cannot_be_read_are_one_line(path, text, reason) -> None:
    path.write_bytes(with_text(json.dumps({"spec": SPEC}).encode()))
    assert ModelFile.read(path).spec.network == "outdet"
    path.write_bytes(with_text(text))
    with pytest.raises(InputError, match=rf"model\.onnx: .*{reason}") as refusal:
        Derainer(path)
    assert str(refusal.value).isprintable()
    assert len(str(refusal.value)) < 1500


def test_scores_that_are_not_a_finite_pair_for_each_cell_are_an_error(monkeypatch) -> None:
    derainer = Derainer(KEPT)
    assert derainer.probability(scene(50)).shape == (50,)
    for scores in (np.zeros((3, 2)), *(np.full((50, 2), bad) for bad in (np.nan, -np.inf))):
        monkeypatch.setattr(derainer.session, "run", lambda _, scores=scores: scores)
        with pytest.raises(InputError, match=r"outdet\.onnx: its scores of .* 50 cells"):
            derainer.probability(scene(50))


def test_a_file_of_any_size_is_not_read_whole(monkeypatch) -> None:
    monkeypatch.setattr(model_file, "LARGEST_MODEL", KEPT.stat().st_size - 1)
    with pytest.raises(InputError, match=r"outdet\.onnx: not an ONNX model \(more than 35,000"):
        Derainer(KEPT)


@pytest.mark.parametrize("archive", [True, False], ids=["archive", "pickle"])
def test_weights_of_pytorch_lead_to_their_import(tmp_path, archive) -> None:
    weights = tmp_path / "weights.pt"
    torch.save({"weight": torch.zeros(3)}, weights, _use_new_zipfile_serialization=archive)
    with pytest.raises(InputError, match=r"weights\.pt: .*`derain import-weights`"):
        Derainer(weights)


def test_weights_are_counted_as_onnx_counts_them() -> None:
    for model in (KEPT, default_model()):
        tensors = onnx.load(model).graph.initializer
        counted = sum(prod(tensor.dims) for tensor in tensors)
        assert number_of_weights(model.read_bytes()) == counted > 0
