"""Tables of arrays: the returns of the beams of a sensor."""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Self

import numpy as np

from derain.scan import Array, Bools, Floats, Ints


@dataclass(frozen=True, eq=False)
class Columns:
    """Arrays of one length, each an attribute of a class derived from this one."""

    def take(self, rows: Array) -> Self:
        """The rows of a mask, bool (N,), or by their numbers, int64 (M,)."""
        return type(self)(*(getattr(self, column.name)[rows] for column in fields(self)))

    @classmethod
    def joined(cls, parts: Iterable[Self]) -> Self:
        """The rows of several, one after the other."""
        rows = list(parts)
        columns = ([getattr(part, column.name) for part in rows] for column in fields(cls))
        return cls(*map(np.concatenate, columns))


@dataclass(frozen=True, eq=False)
class Returns(Columns):
    """Returns to the sensor, ordered by beam.

    Every beam has a row, also one that nothing returned; a sensor of dual returns may give it two,
    the strongest first.

    Attributes:
        range: End of the beam, as a distance from the sensor, float64 (N,), metres; the maximum
            range where nothing returned.
        reflectivity: Apparent reflectivity, float64 (N,), in 0..1: what a surface across the whole
            beam and facing the sensor would need to return as much through clear air. 0 where
            nothing returned.
        label: TrackClass of the surface that was hit, int64 (N,); 0 where nothing returned.
        beam: Row of the beam in :meth:`derain.simulation.sensor.Sensor.beams`, int64 (N,),
            ascending.
    """

    range: Floats
    reflectivity: Floats
    label: Ints
    beam: Ints

    @property
    def returned(self) -> Bools:
        """True where something returned, bool (N,)."""
        return self.reflectivity > 0

    @property
    def power(self) -> Floats:
        """Received power, float64 (N,), m⁻²: 1 for a reflectivity of 1 at 1 m."""
        return self.reflectivity / self.range**2
