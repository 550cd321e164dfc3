"""The metadata of an ONNX file, read from its bytes without the onnx package.

The file is not trusted: all that derain reads of it is checked before a network is made of it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from math import prod
from pathlib import Path
from typing import Any, Self

from derain.errors import InputError
from derain.files.documents import Entry
from derain.files.reading import reading
from derain.spec import Spec

# The one metadata key under which an exported model carries its Spec, its proof and its versions.
METADATA_KEY = "derain"

# Under this key of theirs stands the SHA-256 of the whole file, taken with noughts in its place.
CHECKSUM_KEY = "sha256"
NO_CHECKSUM = "0" * 64

# Only derain 0.1 wrote models without a checksum. They are known by their layout, and not by the
# version that they state: all keys of their metadata, and keys that every later Spec has.
EARLY_METADATA = {"spec", "versions", "proof"}
LATER_SPEC = {"candidates", "training"}

# Twenty times the largest network of derain; protobuf itself ends at 2 GiB.
LARGEST_MODEL = 2**29

# Where tensors stand in an ONNX file: numbers of the fields that hold a part of each kind.
# Source: onnx.proto3, https://github.com/onnx/onnx, IR version 10.
PARTS = {
    "model": {7: "graph", 20: "training", 25: "function"},
    "training": {1: "graph", 2: "graph"},
    "function": {7: "node", 11: "attribute"},
    "graph": {1: "node", 5: "tensor", 15: "sparse tensor"},
    "node": {5: "attribute"},
    "attribute": {
        **{5: "tensor", 6: "graph", 10: "tensor", 11: "graph"},
        **{22: "sparse tensor", 23: "sparse tensor"},
    },
    "sparse tensor": {1: "tensor", 2: "tensor"},
    "tensor": {},
}
GRAPH, INITIALIZER, DIMENSIONS = 7, 5, 1
METADATA_PROPS, PROP_KEY, PROP_VALUE = 14, 1, 2
EXTERNAL_DATA, DATA_LOCATION = 13, 14

# Kinds of protobuf fields. Source: https://protobuf.dev/programming-guides/encoding.
VARINT, COUNTED_BYTES = 0, 2
SIZES = {1: 8, 5: 4}  # of the others, in bytes


@dataclass(frozen=True, eq=False)
class ModelFile:
    """An ONNX file that derain exported.

    Attributes:
        path: The file.
        content: Its bytes.
        metadata: Its Spec, proof, versions and licence.
        spec: How the model is used.
    """

    path: Path
    content: bytes
    metadata: dict[str, Any]
    spec: Spec

    @classmethod
    def read(cls, path: Path) -> Self:
        """Reads a file, and looks at everything but its graph.

        Raises:
            InputError: A file that is missing, too large, not ONNX, not derain's, changed since it
                was exported, without a checksum though not of derain 0.1, or whose weights are in
                another file.
        """
        with reading(path), path.open("rb") as file:
            content = file.read(LARGEST_MODEL + 1)
        if len(content) > LARGEST_MODEL:
            raise _not_a_model(path, f"more than {LARGEST_MODEL:,} bytes")
        try:
            text = _metadata(content)
            external = _has_external_data(content)
        except ValueError as error:
            raise _not_a_model(path, str(error)) from error
        metadata = Entry.of_json(text or "null", path).value
        if not isinstance(metadata, dict) or not isinstance(metadata.get("spec"), dict):
            raise InputError(
                path, "it has no Spec: derain did not export it", "Export it with `derain export`."
            )
        if external:
            raise InputError(path, "its weights are in another file", "Export it again.")
        if CHECKSUM_KEY in metadata:
            _refuse_changed(path, content, metadata[CHECKSUM_KEY])
        elif not metadata.keys() <= EARLY_METADATA or metadata["spec"].keys() & LATER_SPEC:
            raise InputError(
                path,
                "it has no checksum, and every model since derain 0.2 has one",
                "Copy or export it again.",
            )
        return cls(path, content, metadata, Spec.from_dict(metadata["spec"], path))


def with_checksum(content: bytes) -> bytes:
    """The same file with its checksum in place of NO_CHECKSUM in its metadata."""
    place = content.rindex(NO_CHECKSUM.encode())
    digest = _checksum(content, place).encode()
    return content[:place] + digest + content[place + len(digest) :]


def number_of_weights(content: bytes) -> int:
    """Numbers that an exported graph holds: weights, and in eight bits their scales.

    Args:
        content: A whole ONNX file that has been read as a :class:`ModelFile`.
    """
    graphs = _parts(memoryview(content), GRAPH)
    tensors = [tensor for graph in graphs for tensor in _parts(graph, INITIALIZER)]
    sizes = [
        [size for number, size in _fields(tensor) if number == DIMENSIONS and isinstance(size, int)]
        for tensor in tensors
    ]
    return sum(map(prod, sizes))


def _parts(message: memoryview, of_number: int) -> Iterator[memoryview]:
    """The messages in one field of a message."""
    for number, value in _fields(message):
        if number == of_number and isinstance(value, memoryview):
            yield value


def _refuse_changed(path: Path, content: bytes, checksum: Any) -> None:
    """Refuses a file that is not as it was when it was proved."""
    readable = isinstance(checksum, str) and checksum.isascii()
    place = content.rfind(checksum.encode()) if readable else -1
    if place < 0 or _checksum(content, place) != checksum:
        raise InputError(
            path, "it is not as it was exported: its checksum differs", "Copy or export it again."
        )


def _checksum(content: bytes, place: int) -> str:
    """SHA-256 of a file without the checksum at a place of it."""
    view = memoryview(content)
    digest = sha256(view[:place])
    digest.update(NO_CHECKSUM.encode())
    digest.update(view[place + len(NO_CHECKSUM) :])
    return digest.hexdigest()


def _metadata(content: bytes) -> str:
    """The text under METADATA_KEY; empty where there is none."""
    text = b""
    for entry in _parts(memoryview(content), METADATA_PROPS):
        prop = {key: bytes(part) for key, part in _fields(entry) if not isinstance(part, int)}
        if prop.get(PROP_KEY) == METADATA_KEY.encode():
            text = prop.get(PROP_VALUE, b"")
    return text.decode("utf-8")


def _has_external_data(content: bytes) -> bool:
    """True if some tensor is to be read from another file, which could be any."""
    pending = [("model", memoryview(content))]
    while pending:
        kind, message = pending.pop()
        for number, value in _fields(message):
            if kind == "tensor" and number in (EXTERNAL_DATA, DATA_LOCATION) and value:
                return True
            if number in PARTS[kind] and isinstance(value, memoryview):
                pending.append((PARTS[kind][number], value))
    return False


def _fields(message: memoryview) -> Iterator[tuple[int, int | memoryview]]:
    """Number and value of every field of a protobuf message.

    Raises:
        ValueError: Bytes that are no such message.
    """
    place = 0
    while place < len(message):
        tag, place = _varint(message, place)
        number, kind = tag >> 3, tag & 7
        if kind == VARINT:
            value, place = _varint(message, place)
            yield number, value
            continue
        if kind == COUNTED_BYTES:
            size, place = _varint(message, place)
        elif kind in SIZES:
            size = SIZES[kind]
        else:
            raise ValueError("its bytes are no protobuf message")
        if place + size > len(message):
            raise ValueError("it ends in the middle of a field")
        yield number, message[place : place + size]
        place += size


def _varint(message: memoryview, place: int) -> tuple[int, int]:
    """A whole number of seven bits a byte, the lowest first, and the place after it."""
    number = 0
    for shift in range(0, 70, 7):
        if place >= len(message):
            raise ValueError("it ends in the middle of a number")
        byte = message[place]
        place += 1
        number |= (byte & 0x7F) << shift
        if byte < 0x80:
            return number, place
    raise ValueError("a number of more than ten bytes")


def _not_a_model(path: Path, reason: str) -> InputError:
    return InputError(
        path,
        f"not an ONNX model ({reason})",
        "Give a model written by `derain export`; `derain import-weights` reads PyTorch's weights.",
    )
