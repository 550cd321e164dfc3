"""Draws sensors from spans, so that a network that learns from their scans has met any."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Annotated, Any, ClassVar, get_args

import numpy as np
from numpy.random import Generator

from derain.simulation.defects import Defects
from derain.simulation.drawing import Span, log_uniform, pick
from derain.simulation.sensor import MOST_BEAMS, ReturnMode, Sensor
from derain.simulation.settings import LogSpan, Positive, Settings, Share, Within, weights_of
from derain.views.spherical_grid import ALL_AROUND, FULL_CIRCLE

# Numbers of rows, at least one. Sensors of today have at most 256.
MOST_ROWS = 4096
Rows = Annotated[
    tuple[int, ...], lambda rows: rows and all(2 <= count <= MOST_ROWS for count in rows)
]


@dataclass(frozen=True)
class Spans(Settings):
    """Settings that are spans, from which values are drawn by name."""

    def draw(self, name: str, generator: Generator) -> float:
        """Draws from a span: evenly in its logarithm from a LogSpan, else evenly."""
        span: Span = getattr(self, name)
        kind = next(one.type for one in fields(self) if one.name == name)
        if kind == LogSpan:
            return log_uniform(span, generator)
        return float(generator.uniform(*span))


@dataclass(frozen=True)
class DefectSpans(Spans):
    """The ranges that defects of sensors are drawn from; shares are drawn evenly.

    Attributes:
        none: Share of the sensors without any.
        each: Probability of each defect in the others.
        dropped: See :class:`derain.simulation.defects.Defects`, as for all that follow.
        dropped_rows: Likewise.
        dropped_sectors: Likewise.
        mixed: Likewise.
        merging: Likewise, metres.
        range_step: Likewise, metres.
        copies: Likewise, of sensors that report one return. Dual ones copy all or none.
    """

    SUBJECT = "defect spans"
    none: Share = 0.3
    each: Share = 0.5
    dropped: Span = (0.0, 0.3)
    dropped_rows: Span = (0.0, 0.05)
    dropped_sectors: Span = (0.0, 0.05)
    mixed: Span = (0.02, 0.5)
    merging: Span = (0.2, 2.0)
    range_step: Span = (0.002, 0.02)
    copies: Span = (0.0, 0.0)


@dataclass(frozen=True)
class SensorSpans(Spans):
    """The ranges that sensors are drawn from. The defaults span the sensors of today.

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
        most_beams: Largest number of beams. To keep it, columns are farther apart.
        returns: Weight of each way to report a beam with several returns.
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
        defects: Their defects.

    Raises:
        InputError: A value that is impossible.
    """

    SUBJECT = "sensor spans"
    kinds: Mapping[str, float] = field(
        default_factory=lambda: {"spinning": 0.7, "front": 0.2, "rosette": 0.1}
    )
    spinning_rows: Rows = (16, 32, 40, 64, 128)
    spinning_field: Span = (20.0, 90.0)
    spinning_centre: Span = (-12.0, 0.0)
    azimuth_step: LogSpan = (0.08, 0.4)
    uneven: Share = 0.5
    row_azimuth: Span = (0.0, 5.0)
    front_rows: Rows = (64, 96, 128, 192, 256)
    front_width: Span = (60.0, 120.0)
    front_height: Span = (12.0, 40.0)
    front_step: LogSpan = (0.08, 0.3)
    rosette_width: Span = (38.0, 75.0)
    rosette_beams: LogSpan = (10_000.0, 60_000.0)
    prism_turns: LogSpan = (8.0, 40.0)
    most_beams: Annotated[int, Within(1, MOST_BEAMS)] = 150_000
    returns: Mapping[str, float] = field(
        default_factory=lambda: {"strongest": 0.6, "last": 0.1, "dual": 0.3}
    )
    range_noise: LogSpan = (0.005, 0.05)
    range_noise_growth: Span = (0.0, 0.0005)
    weak_range_noise: Span = (0.0, 0.05)
    encoder_noise: Span = (0.0, 0.02)
    intensity_noise: Span = (0.05, 0.3)
    mounting_height: Span = (0.3, 2.8)
    tilt: Span = (0.0, 4.0)
    head_down: Share = 0.1
    head_down_pitch: Span = (10.0, 25.0)
    minimum_range: LogSpan = (0.3, 3.0)
    maximum_range: LogSpan = (50.0, 250.0)
    detection_threshold: LogSpan = (3e-7, 5e-5)
    aperture: Span = (0.0, 0.012)
    beam_divergence: LogSpan = (1e-3, 4e-3)
    frame_rate: Span = (5.0, 20.0)
    defects: DefectSpans = field(default_factory=DefectSpans)
    READ_BY: ClassVar = {
        "kinds": weights_of("spinning", "front", "rosette"),
        "returns": weights_of(*get_args(ReturnMode)),
    }


# The numbers of any sensor, drawn from the spans of their names.
NUMBERS = [one.name for one in fields(Sensor) if one.type in (float, Positive)]

# Defects that only some sensors have.
DEFECTS = ("dropped", "dropped_rows", "dropped_sectors", "mixed", "range_step", "copies")

# The slower prism of a rosette turns the other way. This is its speed as a factor of the faster
# one's: .64 in the Livox Mid-40.
PRISM_RATIO = (0.4, 0.8)

# Lasers of a rosette.
LASERS = (1, 4, 6)


def draw_sensor(spans: SensorSpans, generator: Generator) -> Sensor:
    """Draws a sensor with its defects.

    Args:
        spans: The ranges to draw from.
        generator: Random generator.

    Raises:
        InputError: The spans allow for what no sensor can be, and it was drawn.
    """
    patterns = {"spinning": _spinning, "front": _front, "rosette": _rosette}
    pattern = patterns[pick(spans.kinds, generator)](spans, generator)
    roll, pitch = (spans.draw("tilt", generator) * generator.choice([-1, 1]) for _ in range(2))
    if generator.random() < spans.head_down:
        pitch += spans.draw("head_down_pitch", generator)
    returns: Any = pick(spans.returns, generator)
    drawn: dict[str, Any] = {name: spans.draw(name, generator) for name in NUMBERS}
    return Sensor(
        **pattern,
        **drawn,
        tilt=(roll, pitch),
        returns=returns,
        defects=draw_defects(spans.defects, generator, dual=returns == "dual"),
    )


def draw_defects(spans: DefectSpans, generator: Generator, *, dual: bool) -> Defects:
    """Draws the defects of a sensor's scans.

    Args:
        spans: The ranges to draw from.
        generator: Random generator.
        dual: True if the sensor reports two returns of a beam. Half of those that do report the
            two of every beam, be they the same.
    """
    some = generator.random() >= spans.none
    values = {name: spans.draw(name, generator) for name in DEFECTS}
    has = {name: some and generator.random() < spans.each for name in DEFECTS}
    if dual:
        values["copies"], has["copies"] = 1.0, generator.random() < 0.5
    drawn = {name: value for name, value in values.items() if has[name]}
    return Defects(**drawn, merging=spans.draw("merging", generator))


def _spinning(spans: SensorSpans, generator: Generator) -> dict[str, Any]:
    rows = int(generator.choice(spans.spinning_rows))
    height = min(spans.draw("spinning_field", generator) for _ in range(2))
    centre = spans.draw("spinning_centre", generator)
    inclination = max(centre - height / 2, -90.0), min(centre + height / 2, 90.0)
    even = generator.random() >= spans.uneven
    turned = spans.draw("row_azimuth", generator)
    step = spans.draw("azimuth_step", generator)
    return {
        "azimuth": ALL_AROUND,
        "inclination": inclination,
        "rows": rows,
        "columns": _columns(FULL_CIRCLE, step, rows, spans),
        "row_inclinations": draw_row_table(inclination, rows, generator, even=even),
        "row_azimuths": draw_row_azimuths(rows, turned, generator),
    }


def _front(spans: SensorSpans, generator: Generator) -> dict[str, Any]:
    rows = int(generator.choice(spans.front_rows))
    width, height = (spans.draw(name, generator) for name in ("front_width", "front_height"))
    centre = spans.draw("spinning_centre", generator) / 2
    return {
        "azimuth": (-width / 2, width / 2),
        "inclination": (centre - height / 2, centre + height / 2),
        "rows": rows,
        "columns": _columns(width, spans.draw("front_step", generator), rows, spans),
    }


def _rosette(spans: SensorSpans, generator: Generator) -> dict[str, Any]:
    radius = spans.draw("rosette_width", generator) / 2
    lasers = int(generator.choice(LASERS))
    beams = min(round(spans.draw("rosette_beams", generator)), spans.most_beams)
    turns = spans.draw("prism_turns", generator)
    return {
        "pattern": "rosette",
        "azimuth": (-radius, radius),
        "inclination": (-radius, radius),
        "rows": lasers,
        "columns": max(beams // lasers, 1),
        "prism_turns": (turns, -turns * generator.uniform(*PRISM_RATIO)),
        "row_inclinations": _laser_offsets(lasers, generator),
    }


def _laser_offsets(lasers: int, generator: Generator) -> tuple[float, ...]:
    """Inclinations of a rosette's lasers off their common direction, degrees; none for half."""
    if lasers == 1 or generator.random() < 0.5:
        return ()
    step = generator.uniform(0.1, 0.5)
    return tuple((step * (np.arange(lasers) - (lasers - 1) / 2)).tolist())


def _columns(width: float, step: float, rows: int, spans: SensorSpans) -> int:
    """Number of columns in a field of a width, at a step between columns, both degrees."""
    return max(math.ceil(min(width / step, spans.most_beams // rows)), 1)


# Where the rows of uneven sensors lie closer together than elsewhere, degrees above the horizon:
# lowest and highest place of the band's lower and of its upper edge. That of Pandar64 reaches from
# -6 to 2, that of HDL-64 from -8.3 to 2.
DENSE_BAND = ((-9.0, -3.0), (0.0, 4.0))

# How many times closer: 1.5 in HDL-64, about 8 in Pandar64.
HOW_MUCH_CLOSER = (1.4, 8.0)

# A sensor is not made more exactly than that: deviation of a row from where it should point, as a
# share of the step between rows.
MISALIGNMENT = 0.05


def draw_row_table(
    field: tuple[float, float], rows: int, generator: Generator, *, even: bool
) -> tuple[float, ...]:
    """Draws a table of row inclinations.

    Args:
        field: Lowest and highest row, degrees.
        rows: Number of rows, two or more.
        generator: Random generator.
        even: True if all steps are alike, except for some misalignment.

    Returns:
        Inclinations from top to bottom, degrees, all within the field.
    """
    lowest, highest = field
    corners, density = np.array(field), np.ones(1)
    if not even:
        band = np.clip([generator.uniform(*span) for span in DENSE_BAND], lowest, highest)
        closer = generator.uniform(*HOW_MUCH_CLOSER)
        corners, density = np.array([lowest, *band, highest]), np.array([1.0, closer, 1.0])
    # Rows are even in the density summed up from the lowest corner, and so closer where it is high.
    passed = np.concatenate([[0.0], np.cumsum(density * np.diff(corners))])
    table = np.interp(np.linspace(0, passed[-1], rows), passed, corners)
    table += MISALIGNMENT * np.gradient(table) * generator.normal(size=rows)
    return tuple(np.clip(np.sort(table), lowest, highest)[::-1].round(3).tolist())


def draw_row_azimuths(rows: int, most: float, generator: Generator) -> tuple[float, ...]:
    """Draws by how much the rows of a sensor are turned, degrees.

    Lasers lie in one line, in a few columns beside one another which take the rows in turn (Ouster,
    HDL-64), or each a little aside, by its calibration.

    Args:
        rows: Number of rows.
        most: Most that a row is turned either way.
        generator: Random generator.

    Returns:
        Turns from top to bottom; empty if there are none.
    """
    match generator.choice(["one line", "few columns", "each by itself"]):
        case "one line":
            return ()
        case "few columns":
            columns = generator.integers(2, 9)
            turns = most * np.linspace(1, -1, columns)[np.arange(rows) % columns]
        case _:
            turns = generator.uniform(-most, most, rows)
    return tuple(turns.round(3).tolist())
