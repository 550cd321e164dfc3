"""What precipitation is drawn from: kinds of it, each with its weight."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Self, get_type_hints

import numpy as np

from derain.errors import InputError
from derain.files.documents import Entry
from derain.simulation.drawing import Span
from derain.simulation.flying.kinds import Kind
from derain.simulation.flying.precipitation import Precipitation

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


def draw_precipitation(spans: PrecipitationSpans, generator: np.random.Generator) -> Precipitation:
    """Draws a kind of precipitation by the weights, and then its numbers from their spans."""
    weights = np.array([kind.weight for _, kind in spans.kinds])
    name, kind = spans.kinds[generator.choice(len(weights), p=weights / weights.sum())]
    return kind.draw(name, generator)


def _read(entry: Entry, kind: Kind) -> Kind:
    try:
        return replace(kind, **entry.record(_PARSERS))
    except InputError as error:
        if str(error.subject).startswith("precipitation: "):
            raise entry.fault(f"{error.subject}: {error.reason}", error.remedy) from error
        raise


def _span(entry: Entry) -> Span:
    low, high = entry.numbers(2)
    return low, high


# What reads the attributes of a kind, by their type.
_PARSERS: dict[str, Callable[[Entry], Any]] = {
    name: _span if kind == Span else Entry.number for name, kind in get_type_hints(Kind).items()
}
