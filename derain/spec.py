"""The Spec: everything needed to use a trained network besides its weights."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from derain.errors import InputError
from derain.neighbours import NeighbourView
from derain.range_image import RangeView
from derain.scan import Scan
from derain.spherical_grid import SphericalGrid
from derain.view import View

SCHEMA = 1


@dataclass(frozen=True)
class Spec:
    """How a trained network is used; in its checkpoint and in its ONNX file.

    Attributes:
        network: Name of the network, such as ``outdet``.
        view: Kind and parameters of the view that it sees a scan through.
        channels: Its input channels, in order.
        units: Their units.
        mean: Mean of each channel over the training points; it stands in for values that a scan
            lacks, about which it says least.
        std: Standard deviation of each channel over the training points.
        classes: Names of the training data's semantic classes, by id.
        rain: Ids of those that count as rain.
        rule: Constants of the network's own rule for rain, by name; empty where it has none.
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
    channels: tuple[str, ...]
    units: tuple[str, ...]
    rule: Mapping[str, float] = field(default_factory=dict)
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
            known = {part.name: content[part.name] for part in fields(cls)}
            spec = cls(**{name: _immutable(value) for name, value in known.items()})
            if len({len(spec.channels), len(spec.units), len(spec.mean), len(spec.std)}) > 1:
                raise ValueError("channels, units, mean and std differ in number")
            return replace(spec, classes={int(id_): n for id_, n in known["classes"].items()})
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(
                source, f"its Spec is damaged ({error})", "Export the model again."
            ) from error

    @property
    def mean_intensity(self) -> float:
        """Mean intensity of the training points; 0 for a network that sees none."""
        return self._means.get("intensity", 0.0)

    @property
    def intensity_unit(self) -> str:
        """Unit of the training data's intensity."""
        return dict(zip(self.channels, self.units, strict=True)).get("intensity", "not used")

    def missing_channels(self, scan: Scan) -> dict[str, float]:
        """Channels that a scan has not got, and the means that stand in for them, by name."""
        return {name: mean for name, mean in self._means.items() if scan.channel(name) is None}

    def make_view(self, threads: int = 0) -> View:
        """The view that the network sees a scan through.

        Args:
            threads: Threads it may use; 0 takes every core this process may use.

        Raises:
            InputError: A kind of view that this derain does not know.
        """
        match dict(self.view):
            case {"kind": NeighbourView.KIND, "neighbours": neighbours}:
                return NeighbourView(neighbours, self.channels, self._means, threads)
            case {"kind": RangeView.KIND, "grid": grid, "way_back": way_back}:
                grid = SphericalGrid.from_dict(grid, self.network)
                return RangeView(grid, self.channels, way_back, self._means)
        kind = self.view.get("kind")
        raise InputError(self.network, f"unknown view {kind!r}", "Upgrade derain.")

    @property
    def _means(self) -> dict[str, float]:
        return dict(zip(self.channels, self.mean, strict=True))


def _immutable(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
