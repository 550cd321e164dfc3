"""Regions of particles: all the air, low over the ground, or behind cars."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from derain.scan import Floats
from derain.simulation.classes import TrackClass, unpacked
from derain.simulation.flying.particles import Stretch
from derain.simulation.flying.precipitation import GustForm
from derain.simulation.sensor import Returns

# Number of plane waves of a random field: enough to make it practically Gaussian.
GUST_WAVES = 12

# Share of the densest that is left between sheets and filaments, a modelling choice.
THINNEST = 0.05


class Gusts:
    """All the air, with a density that varies smoothly in space.

    It is made of random fields of plane waves, which have mean 0 and variance 1. *Gusts* are
    logistic in one of them, *sheets* follow the surfaces where one is 0, *filaments* (wisps) the
    lines where two are. All of them are modelling choices.

    Args:
        form: One of those, or ``even``.
        length: Wavelength that the waves have at least, metres: they have up to four times it.
        contrast: Strength of the density's variation with the field.
        seed: Directions of the waves.

    Source: Rahimi and Recht 2007, "Random features for large-scale kernel machines", for fields of
        random plane waves.
    """

    def __init__(self, form: GustForm, length: float, contrast: float, seed: int) -> None:
        generator = np.random.default_rng(seed)
        direction = generator.normal(size=(2, 3, GUST_WAVES))
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        wavelength = length * 4 ** generator.random((2, 1, GUST_WAVES))
        self._wave = 2 * math.pi * direction / wavelength
        self._phase = generator.uniform(0, 2 * math.pi, (2, GUST_WAVES))
        self._form, self._contrast = form, contrast

    def stretch(self, beams: Floats, stretch: Stretch) -> Stretch:
        """The part of each beam's stretch that the region has, at least: all of it.

        Args:
            beams: Unit vectors, float64 (N, 3), sensor frame.
            stretch: The part of the beams in front of the surfaces.
        """
        return stretch

    def density(self, place: Floats) -> Floats:
        """Density over the greatest, float64 (N,), in 0..1, at places, float64 (N, 3), metres."""
        match self._form:
            case "even":
                return np.ones(len(place))
            case "gusts":
                return 1 / (1 + np.exp(-2 * self._contrast * self._field(0, place)))
            case "sheets":
                away = self._field(0, place) ** 2
            case "filaments":
                away = self._field(0, place) ** 2 + self._field(1, place) ** 2
        return THINNEST + (1 - THINNEST) * np.exp(-(self._contrast**2) * away)

    @property
    def mean(self) -> float:
        """Mean density over the greatest, as of Gaussian fields."""
        steepness = 1 + 2 * self._contrast**2
        match self._form:
            case "even":
                return 1.0
            case "gusts":
                return 0.5
            case "sheets":
                return THINNEST + (1 - THINNEST) / math.sqrt(steepness)
            case "filaments":
                return THINNEST + (1 - THINNEST) / steepness

    def _field(self, number: int, place: Floats) -> Floats:
        waves = np.cos(place @ self._wave[number] + self._phase[number])
        return np.asarray(waves.sum(axis=1) * math.sqrt(2 / GUST_WAVES))


# Multiples of its height where the density of a layer has fallen to almost nothing.
LAYER_TOP = 4.0


@dataclass(frozen=True, eq=False)
class GroundLayer:
    """A layer over the ground, which is level, in which the density falls exponentially.

    Attributes:
        ground: Height of the ground in the sensor frame, metres, below 0.
        height: Over which the density falls to 1/e, metres.
        gusts: Further variation.
    """

    ground: float
    height: float
    gusts: Gusts

    def stretch(self, beams: Floats, stretch: Stretch) -> Stretch:
        """The part of each beam below the top of the layer."""
        top = self.ground + LAYER_TOP * self.height
        rise = beams[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = np.nan_to_num(top / rise, nan=math.inf)
        if top > 0:  # beams that rise leave the layer
            leaves = np.where(rise > 0, np.minimum(stretch.far, crossing), stretch.far)
            return Stretch(stretch.near, leaves)
        enters = np.where(rise < 0, np.maximum(stretch.near, crossing), math.inf)
        return Stretch(enters, stretch.far)

    def density(self, place: Floats) -> Floats:
        """Densest at the ground; none below it."""
        above = place[:, 2] - self.ground
        fallen = np.exp(-np.maximum(above, 0) / self.height)
        return np.where(above >= 0, fallen, 0) * self.gusts.density(place)


# A plume of spray, modelling choices after photographs: it is as wide as a car where it begins and
# gets wider, and as high as a car's tail.
PLUME_HALF_WIDTH = 0.9
PLUME_OPENING = 0.15
PLUME_HEIGHT = 0.8

# A car's points are looked for this far around one of them, metres.
CAR_LENGTH = 5.0


@dataclass(frozen=True, eq=False)
class Plume:
    """Spray behind a car: a wedge on the ground, densest at the car's tail.

    Attributes:
        start: Middle of the tail, on the ground, float64 (3,), metres, sensor frame.
        heading: Direction of the plume from there, float64 (3,), a level unit vector.
        length: Metres.
    """

    start: Floats
    heading: Floats
    length: float

    def stretch(self, beams: Floats, stretch: Stretch) -> Stretch:
        """The part of each beam in the sphere around it."""
        centre = self.start + self.heading * self.length / 2
        radius = math.hypot(self.length / 2, self._half_width(self.length), 2 * PLUME_HEIGHT)
        along = beams @ centre
        half = np.sqrt(np.maximum(radius**2 - (centre @ centre - along**2), 0))
        enters, leaves = along - half, along + half
        return Stretch(np.maximum(stretch.near, enters), np.minimum(stretch.far, leaves))

    def density(self, place: Floats) -> Floats:
        """Falls to 1/e halfway along it, and over a third of its height."""
        off = place - self.start
        along, up = off @ self.heading, off[:, 2]
        across = np.abs(off[:, 1] * self.heading[0] - off[:, 0] * self.heading[1])
        inside = (along >= 0) & (along <= self.length) & (across <= self._half_width(along))
        inside &= (up >= 0) & (up <= 2 * PLUME_HEIGHT)
        fallen = np.exp(-2 * along / self.length - 3 * up / PLUME_HEIGHT)
        return np.where(inside, np.minimum(fallen, 1), 0)

    def _half_width(self, along: Floats | float) -> Floats:
        return np.asarray(PLUME_HALF_WIDTH + PLUME_OPENING * along)


# A part of space with a density of particles.
Region = Gusts | GroundLayer | Plume


def draw_plumes(
    clear: Returns, beams: Floats, ground: float, count: int, length: float, generator: Generator
) -> list[Plume]:
    """Plumes behind cars that the beams see.

    Cars drive along x, as on derain's streets, one way or the other.

    Args:
        clear: Return of each beam through clear air.
        beams: Unit vectors along them, float64 (N, 3), sensor frame.
        ground: Height of the ground in the sensor frame, metres.
        count: Number of plumes; fewer only where no car is seen.
        length: Metres.
        generator: Random generator.
    """
    kind, _ = unpacked(clear.label)
    seen = (kind == TrackClass.CAR) & clear.returned
    points = beams[clear.beam[seen]] * clear.range[seen, None]
    plumes = []
    for _ in range(count if len(points) else 0):
        point = points[generator.integers(len(points))]
        direction = generator.choice([-1.0, 1.0])
        near = np.linalg.norm(points[:, :2] - point[:2], axis=1) < CAR_LENGTH
        tail = direction * (direction * points[near, 0]).max()
        middle = (points[near, 1].min() + points[near, 1].max()) / 2
        start, heading = np.array([tail, middle, ground]), np.array([direction, 0.0, 0.0])
        plumes.append(Plume(start, heading, length))
    return plumes
