"""A kind of precipitation, by the spans that its numbers are drawn from."""

import math
from dataclasses import dataclass, fields

import numpy as np

from derain.errors import InputError
from derain.files.documents import shown
from derain.simulation.drawing import Span
from derain.simulation.flying.precipitation import LARGEST, SMALLEST, GustForm, Precipitation

# How the density varies where it does.
UNEVEN: tuple[GustForm, ...] = ("gusts", "sheets", "filaments")

# What is drawn evenly on a logarithmic scale, since it spans decades; the rest evenly as it is.
LOGARITHMIC = frozenset(
    {"number", "diameter", "reach", "crowding", "gust_length"}
    | {"drift", "plume_number", "haze", "haze_depth", "haze_strength"}
)

# What else a span must keep to besides 0 < low <= high.
UPPER_LIMITS = {"reflectivity": 1.0, "haze": 1.0, "largest": LARGEST}
LOWER_LIMITS = {"spill": 1.0, "haze_strength": 1.0, "largest": math.nextafter(SMALLEST, 1)}
FROM_ZERO = frozenset({"flicker", "jitter", "haze_patches", "gust_contrast"})


def _drawn(name: str, span: Span, generator: np.random.Generator) -> float:
    low, high = span
    share = generator.random()
    if name in LOGARITHMIC and low > 0:
        return float(np.clip(low * (high / low) ** share, low, high))
    return float(np.clip(low + (high - low) * share, low, high))


def _possible(name: str, value: float | Span) -> bool:
    if not isinstance(value, tuple):
        return 0 <= value < math.inf and (name == "weight" or value <= 1)
    low, high = value
    # A kind of which nothing falls has 0 and 0.
    from_zero = name in FROM_ZERO or (name == "number" and high == 0)
    least = LOWER_LIMITS.get(name, 0 if from_zero else math.nextafter(0, 1))
    below = high < 1 if name == "flicker" else high <= UPPER_LIMITS.get(name, 1e9)
    return least <= low <= high and below


@dataclass(frozen=True)
class Kind:
    """A kind of precipitation: attributes of :class:`Precipitation` by (lowest, highest).

    Attributes with ``_chance`` say how often something is there at all. All defaults are modelling
    choices around the sources that KINDS names; none of them was chosen by a label.

    Attributes:
        weight: How often it is drawn, over the weights of the other kinds; 0 is never.
        number: m⁻³.
        diameter: Millimetres.
        shape: Of the gamma distribution.
        largest: Diameter, millimetres.
        reflectivity: In 0..1.
        flicker: At most below 1.
        spill: From 1 on.
        reach_chance: How often the reach is stated; else the sensor's threshold gives it.
        reach: Metres.
        nearest: Metres.
        cut_off_chance: How often there is a plain cut-off.
        cut_off: Metres.
        crowding: Detectable particles that an open beam meets on average, at most.
        jitter: Metres.
        gust_chance: How often the density is uneven.
        gust_length: Metres.
        gust_contrast: From soft to sharp.
        drift_chance: How often particles drift along the ground.
        drift: Over those that fall.
        drift_height: Metres.
        plume_chance: How often cars raise spray; where they do, one to three of them.
        plume_number: m⁻³.
        plume_length: Metres.
        haze_chance: How often there is haze.
        haze: Share of the beams.
        haze_depth: Metres.
        haze_strength: Times the threshold.
        haze_patches: From even to sharp.

    Raises:
        InputError: A span that is none, or a chance that is not within 0 and 1.
    """

    weight: float = 1.0
    number: Span = (1.0, 1000.0)
    diameter: Span = (0.5, 2.0)
    shape: Span = (1.0, 3.0)
    largest: Span = (4.0, 8.0)
    reflectivity: Span = (0.02, 0.1)
    flicker: Span = (0.0, 0.9)
    spill: Span = (1.0, 2.0)
    reach_chance: float = 0.5
    reach: Span = (5.0, 30.0)
    nearest: Span = (1.0, 3.0)
    cut_off_chance: float = 0.2
    cut_off: Span = (10.0, 80.0)
    crowding: Span = (0.005, 0.6)
    jitter: Span = (0.0, 0.1)
    gust_chance: float = 0.5
    gust_length: Span = (0.5, 30.0)
    gust_contrast: Span = (0.5, 3.0)
    drift_chance: float = 0.0
    drift: Span = (1.0, 10.0)
    drift_height: Span = (0.05, 0.5)
    plume_chance: float = 0.0
    plume_number: Span = (300.0, 30000.0)
    plume_length: Span = (1.0, 8.0)
    haze_chance: float = 0.1
    haze: Span = (0.001, 0.1)
    haze_depth: Span = (0.3, 8.0)
    haze_strength: Span = (2.0, 1000.0)
    haze_patches: Span = (0.0, 3.0)

    def __post_init__(self) -> None:
        for one in fields(self):
            value = getattr(self, one.name)
            if not _possible(one.name, value):
                raise InputError(
                    f"precipitation: {one.name}", f"{shown(value)} is impossible", "Correct it."
                )

    def draw(self, name: str, generator: np.random.Generator) -> Precipitation:
        """Draws precipitation of this kind."""
        drawn = {
            one.name: _drawn(one.name, getattr(self, one.name), generator)
            for one in fields(self)
            if isinstance(getattr(self, one.name), tuple)
        }
        chances = (
            *(self.reach_chance, self.cut_off_chance, self.gust_chance),
            *(self.drift_chance, self.plume_chance, self.haze_chance),
        )
        reached, cut, uneven, drifts, sprays, hazy = (generator.random(6) < chances).tolist()
        form = UNEVEN[generator.integers(len(UNEVEN))]
        plumes = int(generator.integers(1, 4))
        drawn["reach"] *= reached
        drawn["drift"] *= drifts
        drawn["haze"] *= hazy
        drawn["cut_off"] = drawn["cut_off"] if cut else math.inf
        return Precipitation(
            kind=name,
            gust_form=form if uneven else "even",
            gust_seed=int(generator.integers(2**32)),
            plumes=plumes if sprays else 0,
            **drawn,
        )
