"""The returns of the beams of a sensor."""

from dataclasses import dataclass

from derain.simulation.arrays import Bools, Columns, Floats, Ints


@dataclass(frozen=True, eq=False)
class Returns(Columns):
    """What comes back to the sensor, ordered by beam.

    Every beam has a row, also one that nothing returned; a sensor of dual returns may give it two,
    the strongest first.

    Attributes:
        range: Where the beam ends, as a distance from the sensor, float64 (N,), metres; the maximum
            range where nothing returned.
        reflectivity: Apparent reflectivity, float64 (N,), in 0..1: what a surface across the whole
            beam and facing the sensor would need to return as much through clear air. 0 where
            nothing returned.
        label: TrackClass of what was hit, int64 (N,); 0 where nothing returned.
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
        """Received power, float64 (N,), m⁻²: that of reflectivity 1 at 1 m is 1."""
        return self.reflectivity / self.range**2
