"""Kinds of precipitation, and the spans that their numbers are drawn from."""

import math
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import Self, get_type_hints

import numpy as np
from numpy.random import Generator

from derain.errors import InputError
from derain.files.documents import Entry, shown
from derain.simulation.drawing import Span
from derain.simulation.flying.precipitation import LARGEST, SMALLEST, GustForm, Precipitation
from derain.simulation.sensor_file import PARSERS, read_fields

# How the density varies where it does.
UNEVEN: tuple[GustForm, ...] = ("gusts", "sheets", "filaments")

# Attributes that are log-uniform, since they span decades; the others are uniform.
LOGARITHMIC = frozenset(
    {"number", "diameter", "reach", "crowding", "gust_length"}
    | {"drift", "plume_number", "haze", "haze_depth", "haze_strength"}
)

# Limits of spans besides 0 < low <= high.
UPPER_LIMITS = {"reflectivity": 1.0, "haze": 1.0, "largest": LARGEST}
LOWER_LIMITS = {"spill": 1.0, "haze_strength": 1.0, "largest": math.nextafter(SMALLEST, 1)}
FROM_ZERO = frozenset({"flicker", "jitter", "haze_patches", "gust_contrast"})


def _drawn(name: str, span: Span, generator: Generator) -> float:
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

    Attributes with ``_chance`` are probabilities that something is there at all. All defaults are
    modelling choices around the sources that KINDS names; none of them was chosen by a label.

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

    def draw(self, name: str, generator: Generator) -> Precipitation:
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


# Rain: numbers and sizes from drizzle to a cloudburst as Marshall and Palmer give them above .2 mm;
# the reflectivity is from the Fresnel one of water to that of a drop that also returns light from
# its inside. Snow: Gunn and Marshall's spectra have 10² to 10³ flakes per cubic metre, of .3 to
# 1 mm melted, two to four times as wide unmelted at a density of .02 to .1; single aggregates have
# centimetres. Snow scatters most of the light that meets it.
# Source: Marshall and Palmer 1948; Gunn and Marshall 1958, N0 = 3.8e3 R^-.87 m⁻³ mm⁻¹, Λ = 2.55
# R^-.48 mm⁻¹; Sekhon and Srivastava 1970, "Snow size spectra and radar reflectivity"; Warren 1982,
# "Optical properties of snow"; Charron, Phillips and Waslander 2018 and Kurup and Bos 2021 for snow
# that LiDARs see within 10 to 30 m.
KINDS = {
    "none": Kind(weight=2.0, number=(0.0, 0.0), haze_chance=0.0),
    "drizzle": Kind(number=(300.0, 10000.0), diameter=(0.2, 0.5), largest=(0.8, 2.0)),
    "rain": Kind(number=(30.0, 3000.0), plume_chance=0.3),
    "snow": Kind(
        weight=3.0,
        number=(3.0, 3000.0),
        diameter=(0.7, 4.0),
        largest=(4.0, 20.0),
        reflectivity=(0.1, 0.9),
        spill=(1.0, 3.0),
        reach=(5.0, 40.0),
        crowding=(0.02, 1.5),
        drift_chance=0.2,
        plume_chance=0.1,
    ),
    "aggregates": Kind(
        number=(0.1, 100.0),
        diameter=(3.0, 12.0),
        shape=(1.0, 4.0),
        largest=(10.0, 30.0),
        reflectivity=(0.1, 0.9),
        spill=(1.0, 3.0),
        reach=(10.0, 80.0),
        crowding=(0.01, 0.6),
    ),
    "blizzard": Kind(
        number=(300.0, 30000.0),
        diameter=(0.3, 1.0),
        largest=(2.0, 6.0),
        reflectivity=(0.1, 0.9),
        spill=(1.0, 3.0),
        reach=(3.0, 30.0),
        crowding=(0.1, 2.0),
        gust_chance=0.9,
        drift_chance=0.7,
        haze_chance=0.3,
    ),
    "fog": Kind(weight=0.5, number=(0.0, 0.0), haze_chance=1.0),
    "spray": Kind(
        weight=0.5,
        number=(0.0, 0.0),
        diameter=(0.3, 1.0),
        reach_chance=1.0,
        reach=(8.0, 60.0),
        plume_chance=1.0,
        plume_number=(30.0, 3000.0),
        haze_chance=0.3,
    ),
}


@dataclass(frozen=True)
class PrecipitationSpans:
    """Kinds of precipitation, by name.

    Attributes:
        kinds: Their names and spans; the default is all of KINDS.

    Raises:
        InputError: No kind that has a weight.
    """

    kinds: tuple[tuple[str, Kind], ...] = field(default=tuple(KINDS.items()))

    def __post_init__(self) -> None:
        if not any(kind.weight for _, kind in self.kinds):
            raise InputError("precipitation", "no kind has a weight", "Give one kind a weight.")

    @classmethod
    def of(cls, entry: Entry) -> Self:
        """Reads kinds from a document.

        Args:
            entry: Names of KINDS, and of each what differs from there, such as
                ``snow: {weight: 2, number: [10, 100]}``. Kinds that are left out are never drawn.

        Raises:
            InputError: No such kind or attribute, or a value that it cannot have.
        """
        parsers = {name: lambda part, name=name: _read(part, KINDS[name]) for name in KINDS}
        kinds = entry.record(parsers)
        try:
            return cls(tuple(kinds.items()))
        except InputError as error:
            raise entry.fault(error.reason, error.remedy) from error


def draw_precipitation(spans: PrecipitationSpans, generator: Generator) -> Precipitation:
    """Draws a kind of precipitation by the weights, and then its numbers from their spans."""
    weights = np.array([kind.weight for _, kind in spans.kinds])
    name, kind = spans.kinds[generator.choice(len(weights), p=weights / weights.sum())]
    return kind.draw(name, generator)


def _read(entry: Entry, kind: Kind) -> Kind:
    parsers = {name: PARSERS[hint] for name, hint in get_type_hints(Kind).items()}
    return read_fields(partial(replace, kind), entry, parsers)
