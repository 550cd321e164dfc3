"""What sensors are drawn from: a span, or choices with weights, for each property."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self, get_args, get_type_hints

import numpy as np
from numpy.random import Generator

from derain.errors import InputError
from derain.files.documents import Entry, shown
from derain.simulation.drawing import Span, log_uniform
from derain.simulation.sensor import ReturnMode
from derain.simulation.sensor_file import PARSERS, read_fields

# Sensors of today have at most 256.
MOST_ROWS = 4096

# Kinds of drawn sensors.
SENSOR_KINDS = ("spinning", "front", "rosette")


class ReadableSpans:
    """Spans that can be read from a document."""

    @classmethod
    def of(cls, entry: Entry) -> Self:
        """Reads what a document states; the rest is as by default.

        Raises:
            InputError: Another key, or a value of another kind or that is impossible.
        """
        hints = get_type_hints(cls)
        return read_fields(cls, entry, {name: _PARSERS[hint] for name, hint in hints.items()})


@dataclass(frozen=True)
class DefectSpans(ReadableSpans):
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
        _check_spans(self, "defect spans")
        for name in ("none", "each"):
            if not 0 <= getattr(self, name) <= 1:
                raise _impossible("defect spans", self, name, "Give a share of 0 to 1.")


@dataclass(frozen=True)
class SensorSpans(ReadableSpans):
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

    def __post_init__(self) -> None:
        subject = "sensor spans"
        _check_spans(self, subject)
        for name in LOGARITHMIC_SPANS:
            if getattr(self, name)[0] <= 0:
                raise _impossible(subject, self, name, "Give two numbers above 0.")
        for name in ("spinning_rows", "front_rows"):
            if not getattr(self, name) or min(getattr(self, name)) < 2:
                raise _impossible(subject, self, name, "Give numbers from 2 on.")
        for name in ("uneven", "head_down"):
            if not 0 <= getattr(self, name) <= 1:
                raise _impossible(subject, self, name, "Give a share of 0 to 1.")
        for name, known in (("kinds", SENSOR_KINDS), ("returns", get_args(ReturnMode))):
            weights = getattr(self, name)
            positive = all(weight >= 0 for weight in weights.values()) and any(weights.values())
            if not positive or not weights.keys() <= set(known):
                raise _impossible(subject, self, name, f"Give weights of {', '.join(known)}.")


# Spans that are log-uniform.
LOGARITHMIC_SPANS = frozenset(
    {
        *("azimuth_step", "front_step", "rosette_beams", "prism_turns", "range_noise"),
        *("minimum_range", "maximum_range", "detection_threshold", "beam_divergence"),
    }
)


def draw(spans: Any, name: str, generator: Generator) -> float:
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


def draw_kind(weights: Mapping[str, float], generator: Generator) -> str:
    """Draws a name by weights, which need not add up to 1."""
    share = np.array(list(weights.values())) / sum(weights.values())
    return str(generator.choice(list(weights), p=share))


def _check_spans(spans: Any, subject: str) -> None:
    for name, kind in get_type_hints(type(spans)).items():
        if kind == Span:
            low, high = getattr(spans, name)
            if not (low <= high and math.isfinite(high - low)):
                raise _impossible(subject, spans, name, "Give two numbers, the lower one first.")


def _impossible(subject: str, spans: Any, name: str, remedy: str) -> InputError:
    return InputError(f"{subject}: {name}", f"{shown(getattr(spans, name))} is impossible", remedy)


# What reads a property, by its type.
_PARSERS = PARSERS | {
    tuple[int, ...]: lambda entry: tuple(item.whole(2, MOST_ROWS) for item in entry.items()),
    Mapping[str, float]: lambda entry: {
        name: one.number() for name, one in entry.members().items()
    },
    DefectSpans: DefectSpans.of,
}
