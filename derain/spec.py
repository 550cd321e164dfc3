"""The Spec: everything needed to use a trained network besides its weights."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

from derain.errors import InputError
from derain.neighbours import NeighbourView

SCHEMA = 1

CHANNELS = ("x", "y", "z", "intensity")


@dataclass(frozen=True)
class Spec:
    """How a trained network is used; in its checkpoint and in its ONNX file.

    Attributes:
        network: Name of the network, such as ``outdet``.
        view: Kind and parameters of the view that it sees a scan through.
        channels: Its input channels, in order.
        units: Their units.
        mean: Mean of each channel that the network's input is centred by.
        std: Standard deviation of each channel that the input is divided by.
        classes: Names of the training data's semantic classes, by id.
        rain: Ids of those that count as rain.
        threshold: A point is rain where its probability is greater.
        data: Name of the training data.
        licence: Licence of the training data.
        schema: Version of this layout.
    """

    network: str
    view: Mapping[str, Any]
    mean: tuple[float, ...]
    std: tuple[float, ...]
    classes: Mapping[int, str]
    rain: tuple[int, ...]
    data: str
    licence: str
    units: tuple[str, ...]
    channels: tuple[str, ...] = CHANNELS
    threshold: float = 0.5
    schema: int = SCHEMA

    def as_dict(self) -> dict[str, Any]:
        """The Spec as JSON-able primitives."""
        return json.loads(json.dumps(asdict(self)))  # type: ignore[no-any-return]

    @classmethod
    def from_dict(cls, content: Mapping[str, Any], source: str | Path) -> "Spec":
        """Reads a Spec back.

        Args:
            content: What :meth:`as_dict` gave.
            source: The file it was found in, for messages.

        Raises:
            InputError: A newer schema, or something that is not a Spec.
        """
        schema = content.get("schema")
        if isinstance(schema, int) and schema > SCHEMA:
            raise InputError(
                source,
                f"its Spec has schema {schema}, newer than this derain's {SCHEMA}",
                "Upgrade derain.",
            )
        try:
            known = {field.name: content[field.name] for field in fields(cls)}
            spec = cls(**{name: _immutable(value) for name, value in known.items()})
            return replace(spec, classes={int(id_): n for id_, n in known["classes"].items()})
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(
                source, f"its Spec is damaged ({error})", "Export the model again."
            ) from error

    def make_view(self, threads: int = 0) -> NeighbourView:
        """The view that the network sees a scan through.

        Args:
            threads: Threads it may use; 0 takes every core this process may use.

        Raises:
            InputError: A kind of view that this derain does not know.
        """
        parameters = dict(self.view)
        kind = parameters.pop("kind", None)
        if kind != NeighbourView.KIND:
            raise InputError(self.network, f"unknown view {kind!r}", "Upgrade derain.")
        # The training data's mean says least about points whose intensity was not measured.
        return NeighbourView(**parameters, missing_intensity=self.mean[3], threads=threads)


def _immutable(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
