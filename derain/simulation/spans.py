"""What sensors are drawn from: a span, or choices with weights, for each property."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, get_args

from numpy.random import Generator

from derain.simulation.drawing import Span, log_uniform
from derain.simulation.sensor import MOST_BEAMS, ReturnMode
from derain.simulation.settings import Settings, weights_of

# Sensors of today have at most 256.
MOST_ROWS = 4096

# Spans that are log-uniform.
LOGARITHMIC_SPANS = frozenset(
    {
        *("azimuth_step", "front_step", "rosette_beams", "prism_turns", "range_noise"),
        *("minimum_range", "maximum_range", "detection_threshold", "beam_divergence"),
    }
)


@dataclass(frozen=True)
class DefectSpans(Settings):
    """What the defects of sensors are drawn from; shares are drawn evenly.

    Attributes:
        none: Share of the sensors without any.
        each: How probable each defect is in the others.
        dropped: See :class:`derain.simulation.defects.Defects`, as for all that follow.
        dropped_rows: Likewise.
        dropped_sectors: Likewise.
        mixed: Likewise.
        merging: Likewise, metres.
        range_step: Likewise, metres.
        copies: Likewise, of sensors that report one return. Dual ones copy all or none.
    """

    none: float = 0.3
    each: float = 0.5
    dropped: Span = (0.0, 0.3)
    dropped_rows: Span = (0.0, 0.05)
    dropped_sectors: Span = (0.0, 0.05)
    mixed: Span = (0.02, 0.5)
    merging: Span = (0.2, 2.0)
    range_step: Span = (0.002, 0.02)
    copies: Span = (0.0, 0.0)

    def __post_init__(self) -> None:
        shares = {"none": 0 <= self.none <= 1, "each": 0 <= self.each <= 1}
        self._refuse_impossible("defect spans", shares)


@dataclass(frozen=True)
class SensorSpans(Settings):
    """What sensors are drawn from. The defaults span the sensors of today.

    Angles are in degrees, distances in metres. Spans of a decade or more are
    log-uniform where stated, the others uniform.

    Attributes:
        kinds: Weight of each kind: ``spinning`` sees a full circle in rows, ``front`` looks one way
            in rows, ``rosette`` one way along a rosette.
        spinning_rows: Rows of a spinning sensor, each as probable.
        spinning_field: Angle between its lowest and highest row; the narrower of two draws.
        spinning_centre: Inclination of the middle between them.
        azimuth_step: Between its columns. Log-uniform.
        uneven: Share of spinning sensors whose rows are closer together at the horizon.
        row_azimuth: Most that its rows are turned.
        front_rows: Rows of a sensor that looks one way, each as probable.
        front_width: Its field of view, from right to left.
        front_height: Likewise, from bottom to top.
        front_step: Between its columns.
        rosette_width: Diameter of a rosette.
        rosette_beams: Shots of a rosette. Log-uniform.
        prism_turns: Turns of the faster prism in a scan. Log-uniform.
        most_beams: Where a sensor would have more, its columns are farther apart.
        returns: Weight of what is reported of a beam that several things return.
        range_noise: Log-uniform.
        range_noise_growth: Metres per metre.
        weak_range_noise: Metres.
        encoder_noise: Degrees.
        intensity_noise: Relative to intensity.
        mounting_height: Metres.
        tilt: Roll and pitch, either way.
        head_down: Share of the sensors that are mounted head down besides.
        head_down_pitch: By so much.
        minimum_range: Log-uniform.
        maximum_range: Log-uniform.
        detection_threshold: Log-uniform, m⁻².
        aperture: Metres.
        beam_divergence: Log-uniform, radians.
        frame_rate: Hz.
        defects: What is wrong with them.

    Raises:
        InputError: A value that is impossible.
    """

    kinds: Mapping[str, float] = field(
        default_factory=lambda: {"spinning": 0.7, "front": 0.2, "rosette": 0.1}
    )
    spinning_rows: tuple[int, ...] = (16, 32, 40, 64, 128)
    spinning_field: Span = (20.0, 90.0)
    spinning_centre: Span = (-12.0, 0.0)
    azimuth_step: Span = (0.08, 0.4)
    uneven: float = 0.5
    row_azimuth: Span = (0.0, 5.0)
    front_rows: tuple[int, ...] = (64, 96, 128, 192, 256)
    front_width: Span = (60.0, 120.0)
    front_height: Span = (12.0, 40.0)
    front_step: Span = (0.08, 0.3)
    rosette_width: Span = (38.0, 75.0)
    rosette_beams: Span = (10_000.0, 60_000.0)
    prism_turns: Span = (8.0, 40.0)
    most_beams: int = 150_000
    returns: Mapping[str, float] = field(
        default_factory=lambda: {"strongest": 0.6, "last": 0.1, "dual": 0.3}
    )
    range_noise: Span = (0.005, 0.05)
    range_noise_growth: Span = (0.0, 0.0005)
    weak_range_noise: Span = (0.0, 0.05)
    encoder_noise: Span = (0.0, 0.02)
    intensity_noise: Span = (0.05, 0.3)
    mounting_height: Span = (0.3, 2.8)
    tilt: Span = (0.0, 4.0)
    head_down: float = 0.1
    head_down_pitch: Span = (10.0, 25.0)
    minimum_range: Span = (0.3, 3.0)
    maximum_range: Span = (50.0, 250.0)
    detection_threshold: Span = (3e-7, 5e-5)
    aperture: Span = (0.0, 0.012)
    beam_divergence: Span = (1e-3, 4e-3)
    frame_rate: Span = (5.0, 20.0)
    defects: DefectSpans = field(default_factory=DefectSpans)
    READ_BY: ClassVar = {
        "kinds": weights_of("spinning", "front", "rosette"),
        "returns": weights_of(*get_args(ReturnMode)),
    }

    def __post_init__(self) -> None:
        possible = {
            "spinning_rows": _are_rows(self.spinning_rows),
            "front_rows": _are_rows(self.front_rows),
            "most_beams": 1 <= self.most_beams <= MOST_BEAMS,
            "uneven": 0 <= self.uneven <= 1,
            "head_down": 0 <= self.head_down <= 1,
        }
        for name in LOGARITHMIC_SPANS:
            low, high = getattr(self, name)
            possible[name] = 0 < low <= high < math.inf
        self._refuse_impossible("sensor spans", possible)


def _are_rows(rows: tuple[int, ...]) -> bool:
    return bool(rows) and all(2 <= count <= MOST_ROWS for count in rows)


def draw(spans: DefectSpans | SensorSpans, name: str, generator: Generator) -> float:
    """Draws a value from a span.

    Args:
        spans: What has it.
        name: Its name.
        generator: Random generator.
    """
    span: Span = getattr(spans, name)
    if name in LOGARITHMIC_SPANS:
        return log_uniform(span, generator)
    return float(generator.uniform(*span))
