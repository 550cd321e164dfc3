"""The parameters of the precipitation in a scan."""

import math
from dataclasses import dataclass, fields
from typing import Literal, get_args

from derain.errors import InputError

# How the density of particles varies in space, see :class:`derain.simulation.flying.gusts.Gusts`.
GustForm = Literal["even", "gusts", "sheets", "filaments"]

# Diameters that are drawn at all, millimetres. What is smaller returns too little to be seen one by
# one; the largest aggregates of snow on record are rare exceptions.
# Source: Lawson, Stewart and Angus 1998, "Observations and numerical simulations of the origin and
# development of very large snowflakes", for aggregates of several centimetres.
SMALLEST, LARGEST = 0.2, 40.0


@dataclass(frozen=True)
class Precipitation:
    """What flies in a scan; the defaults are clear air.

    Attributes:
        kind: Name of the kind that it was drawn from; nothing depends on it.
        number: Falling particles per cubic metre where they are densest, m⁻³.
        diameter: Mean diameter before the distribution is cut at both ends, millimetres.
        shape: Of the gamma distribution of diameters; 1 is exponential, more is narrower.
        largest: Diameter that none exceeds, millimetres.
        reflectivity: Of a particle's surface, in 0..1.
        flicker: By what share the reflectivity of single particles falls short of it at most.
        spill: Width of a beam over the sensor's, at least 1: light at its edges, and what the
            sensor turns on while it listens, let neighbouring beams meet one particle.
        reach: Distance where a particle of ``diameter`` in the middle of a beam is just detected,
            metres; 0 leaves it to the sensor's threshold.
        nearest: Distance within which no particle is reported, metres, if it is more than the
            sensor's own: so near, receivers see little of what does not fill their beams.
        cut_off: Distance beyond which no particle is reported, metres.
        crowding: Detectable particles that an open beam meets on average, at most; where
            ``number`` gives more, there are fewer.
        jitter: Standard deviation of the distance of a particle at the detection threshold, metres;
            it falls with the root of the power, and adds to the sensor's own noise.
        gust_form: How the density varies in space.
        gust_length: Over which length it does, metres.
        gust_contrast: How sharply it does.
        gust_seed: Where its waves run.
        drift: Particles that drift at the ground over those that fall.
        drift_height: Height over which their density falls to 1/e, metres.
        plumes: How many cars raise spray, where so many are seen.
        plume_number: Drops per cubic metre of spray where it is densest, m⁻³.
        plume_length: Length of a plume, metres.
        haze: Share of the beams in which the air or water on the sensor returns something.
        haze_depth: Mean distance of those returns beyond the minimum range, metres.
        haze_strength: Their greatest power over the detection threshold.
        haze_patches: How sharply they gather in parts of the view; 0 is everywhere alike.

    Raises:
        InputError: A value that no precipitation can have.
    """

    kind: str = "none"
    number: float = 0.0
    diameter: float = 1.0
    shape: float = 1.0
    largest: float = 6.0
    reflectivity: float = 0.5
    flicker: float = 0.0
    spill: float = 1.0
    reach: float = 0.0
    nearest: float = 0.0
    cut_off: float = math.inf
    crowding: float = math.inf
    jitter: float = 0.0
    gust_form: GustForm = "even"
    gust_length: float = 5.0
    gust_contrast: float = 2.0
    gust_seed: int = 0
    drift: float = 0.0
    drift_height: float = 0.2
    plumes: int = 0
    plume_number: float = 0.0
    plume_length: float = 5.0
    haze: float = 0.0
    haze_depth: float = 2.0
    haze_strength: float = 10.0
    haze_patches: float = 0.0

    def __post_init__(self) -> None:
        possible = {
            "diameter": 0 < self.diameter < math.inf,
            "shape": 0 < self.shape < math.inf,
            "largest": SMALLEST < self.largest <= LARGEST,
            "reflectivity": 0 < self.reflectivity <= 1,
            "flicker": 0 <= self.flicker < 1,
            "spill": 1 <= self.spill < math.inf,
            "cut_off": self.cut_off > 0,
            "crowding": self.crowding > 0,
            "gust_form": self.gust_form in get_args(GustForm),
            "gust_length": 0 < self.gust_length < math.inf,
            "drift_height": 0 < self.drift_height < math.inf,
            "plume_length": 0 < self.plume_length < math.inf,
            "haze": 0 <= self.haze <= 1,
            "haze_depth": 0 < self.haze_depth < math.inf,
            "haze_strength": 1 <= self.haze_strength < math.inf,
        }
        for field in fields(self):
            value = getattr(self, field.name)
            # What has no condition of its own is a number or density from 0 on.
            if not possible.get(field.name, isinstance(value, str) or 0 <= value < math.inf):
                raise InputError(
                    f"precipitation: {field.name}", f"{value!r} is impossible", "Correct it."
                )
