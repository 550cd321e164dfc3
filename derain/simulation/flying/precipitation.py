"""The precipitation of a scan, and the kinds that it is drawn from."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Annotated, Any, Literal

import numpy as np
from numpy.random import Generator

from derain.files.documents import Entry, packaged
from derain.simulation.drawing import Span, pick
from derain.simulation.settings import Positive, Settings, Share

# How the density of particles varies in space, see :class:`derain.simulation.flying.regions.Gusts`.
GustForm = Literal["even", "gusts", "sheets", "filaments"]

# Range of diameters that are drawn, millimetres. Smaller particles return too little to be seen
# singly; the largest aggregates of snow on record are rare exceptions.
# Source: Lawson, Stewart and Angus 1998, "Observations and numerical simulations of the origin and
# development of very large snowflakes", for aggregates of several centimetres.
SMALLEST, LARGEST = 0.2, 40.0

# Finite numbers from 1 on, and numbers above 0 that may be infinite.
Factor = Annotated[float, lambda value: 1 <= value < math.inf]
Limit = Annotated[float, lambda value: value > 0]


@dataclass(frozen=True)
class Precipitation(Settings):
    """The precipitation of a scan; the defaults are clear air.

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
        gust_form: Form of the density's variation in space.
        gust_length: Over which length it does, metres.
        gust_contrast: Strength of that variation.
        gust_seed: Directions of its waves.
        drift: Particles that drift at the ground over those that fall.
        drift_height: Height over which their density falls to 1/e, metres.
        plumes: Number of cars that raise spray; fewer if fewer are seen.
        plume_number: Drops per cubic metre of spray where it is densest, m⁻³.
        plume_length: Length of a plume, metres.
        haze: Share of the beams in which the air or water on the sensor returns something.
        haze_depth: Mean distance of those returns beyond the minimum range, metres.
        haze_strength: Their greatest power over the detection threshold.
        haze_patches: Strength of their concentration in parts of the view; 0 is uniform.

    Raises:
        InputError: A value that no precipitation can have.
    """

    SUBJECT = "precipitation"
    kind: str = "none"
    number: float = 0.0
    diameter: Positive = 1.0
    shape: Positive = 1.0
    largest: Annotated[float, lambda diameter: SMALLEST < diameter <= LARGEST] = 6.0
    reflectivity: Annotated[float, lambda share: 0 < share <= 1] = 0.5
    flicker: Annotated[float, lambda share: 0 <= share < 1] = 0.0
    spill: Factor = 1.0
    reach: float = 0.0
    nearest: float = 0.0
    cut_off: Limit = math.inf
    crowding: Limit = math.inf
    jitter: float = 0.0
    gust_form: GustForm = "even"
    gust_length: Positive = 5.0
    gust_contrast: float = 2.0
    gust_seed: int = 0
    drift: float = 0.0
    drift_height: Positive = 0.2
    plumes: int = 0
    plume_number: float = 0.0
    plume_length: Positive = 5.0
    haze: Share = 0.0
    haze_depth: Positive = 2.0
    haze_strength: Factor = 10.0
    haze_patches: float = 0.0


# How the density varies where it does.
UNEVEN: tuple[GustForm, ...] = ("gusts", "sheets", "filaments")

# No attribute that spans decades is drawn from more.
GREATEST = 1e9


def is_span_of_decades(span: Span) -> bool:
    """True if a number can be drawn from a span evenly in its logarithm, or is always 0."""
    low, high = span
    return (low > 0 or high == 0) and low <= high <= GREATEST


# A span of decades, which a number is drawn from evenly in its logarithm; any other Span is even.
Decades = Annotated[Span, is_span_of_decades]


@dataclass(frozen=True)
class Kind(Settings):
    """A kind of precipitation: attributes of :class:`Precipitation` by (lowest, highest).

    Attributes with ``_chance`` are probabilities that something is there at all. All defaults are
    modelling choices around the sources that kinds.yaml names; none of them was chosen by a label.

    Attributes:
        weight: Relative frequency of its draws among the kinds; 0 is never.
        number: m⁻³.
        diameter: Millimetres.
        shape: Of the gamma distribution.
        largest: Diameter, millimetres.
        reflectivity: In 0..1.
        flicker: At most below 1.
        spill: From 1 on.
        reach_chance: Probability of a stated reach; else the sensor's threshold gives it.
        reach: Metres.
        nearest: Metres.
        cut_off_chance: Probability of a plain cut-off.
        cut_off: Metres.
        crowding: Detectable particles that an open beam meets on average, at most.
        jitter: Metres.
        gust_chance: Probability of uneven density.
        gust_length: Metres.
        gust_contrast: From soft to sharp.
        drift_chance: Probability of particles drifting along the ground.
        drift: Over those that fall.
        drift_height: Metres.
        plume_chance: Probability of spray behind cars; where they do, one to three of them.
        plume_number: m⁻³.
        plume_length: Metres.
        haze_chance: Probability of haze.
        haze: Share of the beams.
        haze_depth: Metres.
        haze_strength: Times the threshold.
        haze_patches: From even to sharp.

    Raises:
        InputError: A span that is none, or a chance that is not within 0 and 1.
    """

    SUBJECT = "precipitation"
    weight: float = 1.0
    number: Decades = (1.0, 1000.0)
    diameter: Decades = (0.5, 2.0)
    shape: Span = (1.0, 3.0)
    largest: Span = (4.0, 8.0)
    reflectivity: Span = (0.02, 0.1)
    flicker: Span = (0.0, 0.9)
    spill: Span = (1.0, 2.0)
    reach_chance: Share = 0.5
    reach: Decades = (5.0, 30.0)
    nearest: Span = (1.0, 3.0)
    cut_off_chance: Share = 0.2
    cut_off: Span = (10.0, 80.0)
    crowding: Decades = (0.005, 0.6)
    jitter: Span = (0.0, 0.1)
    gust_chance: Share = 0.5
    gust_length: Decades = (0.5, 30.0)
    gust_contrast: Span = (0.5, 3.0)
    drift_chance: Share = 0.0
    drift: Decades = (1.0, 10.0)
    drift_height: Span = (0.05, 0.5)
    plume_chance: Share = 0.0
    plume_number: Decades = (300.0, 30000.0)
    plume_length: Span = (1.0, 8.0)
    haze_chance: Share = 0.1
    haze: Decades = (0.001, 0.1)
    haze_depth: Decades = (0.3, 8.0)
    haze_strength: Decades = (2.0, 1000.0)
    haze_patches: Span = (0.0, 3.0)

    def __post_init__(self) -> None:
        for end in (0, 1):
            ends: dict[str, Any] = {name: getattr(self, name)[end] for name in SPANS}
            Precipitation(**ends)
        super().__post_init__()

    def draw(self, name: str, generator: Generator) -> Precipitation:
        """Draws precipitation of this kind."""
        drawn = {name: self._draw(name, generator) for name in SPANS}
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

    def _draw(self, name: str, generator: Generator) -> float:
        low, high = getattr(self, name)
        share = generator.random()
        if SPANS[name] == Decades and low > 0:
            return float(np.clip(low * (high / low) ** share, low, high))
        return float(np.clip(low + (high - low) * share, low, high))


# The attributes of a kind that are spans, in order, and their types.
SPANS = {one.name: one.type for one in fields(Kind) if one.type in (Span, Decades)}

# The kinds that there are, by name.
KINDS = Entry.of_yaml(packaged("derain.simulation.flying")["kinds"]).each(Kind.of)


def kinds_of(entry: Entry) -> dict[str, Kind]:
    """Reads kinds from a document.

    Args:
        entry: Names of KINDS, and of each what differs from there, such as
            ``snow: {weight: 2, number: [10, 100]}``. Kinds that are left out are never drawn.

    Raises:
        InputError: No such kind or attribute, a value that it cannot have, or no weight at all.
    """
    kinds: dict[str, Kind] = entry.record({name: kind.changed for name, kind in KINDS.items()})
    if not any(kind.weight for kind in kinds.values()):
        raise entry.fault("no kind has a weight", "Give one kind a weight.")
    return kinds


def draw_precipitation(kinds: Mapping[str, Kind], generator: Generator) -> Precipitation:
    """Draws a kind of precipitation by the weights, and then its numbers from their spans."""
    name = pick({name: kind.weight for name, kind in kinds.items()}, generator)
    return kinds[name].draw(name, generator)
