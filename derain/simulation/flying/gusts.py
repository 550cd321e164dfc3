"""How the density of particles varies in space: gusts, sheets and filaments of them."""

import math

import numpy as np

from derain.simulation.arrays import Floats
from derain.simulation.flying.precipitation import GustForm

# Plane waves of a random field; from so many on it is as good as Gaussian.
GUST_WAVES = 12

# Share of the densest that is left between sheets and filaments, a modelling choice.
THINNEST = 0.05


class Gusts:
    """A density over its greatest value, in 0..1, that varies smoothly in space.

    It is made of random fields of plane waves, which have mean 0 and variance 1. *Gusts* are
    logistic in one of them, *sheets* follow the surfaces where one is 0, *filaments* (wisps) the
    lines where two are. All of them are modelling choices.

    Args:
        form: One of those, or ``even``.
        length: Wavelength that the waves have at least, metres: they have up to four times it.
        contrast: How sharply the density follows the field.
        seed: Where the waves run.

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

    def __call__(self, place: Floats) -> Floats:
        """Density over the greatest, float64 (N,), at places, float64 (N, 3), metres."""
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
