"""A 4D radar, and its detections of a track in the rain.

The radar sorts its echoes into cells of inclination, azimuth and range. The mean echo of a cell is
the sum of its surfaces, its rain and noise. Every frame draws the echo of each cell anew,
at random about that mean, and a cell whose echo exceeds those of its neighbours in range is a
detection. Echoes are radar cross-sections in m². The rain's attenuation is left out: through a
facility's rain and back it is 2 dB, less than an echo varies from frame to frame.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from derain.scan import Floats, Scan
from derain.simulation.classes import TrackClass
from derain.simulation.rain_field import EXTINCTION_EFFICIENCY, RainField, extinction
from derain.simulation.sensor import Sensor
from derain.simulation.track import Track

# Radar cross-section of a surface per square metre that the radar sees of it, dB. Modelling
# choices: they come to some 10 dBsm for a car, -3 for a bike and -9 for a pedestrian. In proportion
# to the area seen, the echo of the ground falls with the sine of the grazing angle.
# Source of that law: Barton, "Radar Equations for Modern Radar", constant-gamma clutter.
ECHO_PER_AREA = {
    TrackClass.BACKGROUND: -14.0,
    TrackClass.CAR: 5.0,
    TrackClass.SPRINKLER: 0.0,
    TrackClass.RAIN: -math.inf,
    TrackClass.PEDESTRIAN: -6.0,
    TrackClass.BIKE: 0.0,
    TrackClass.TARGET: 3.0,
    TrackClass.ROAD: -20.0,
}

# Echo of a rain drop over its cross-section. At 77 GHz the drops that matter are as large as the
# wavelength, 3.9 mm: Mie's theory gives 0.91, 0.91 and 0.89 at 10, 25 and 50 mm/h.
BACKSCATTER_EFFICIENCY = 0.9

# Speed of a falling drop of 2 mm, m/s.
# Source: Atlas, Srivastava and Sekhon 1973, 9.65 - 10.3 exp(-0.6 D).
FALL_SPEED = 9.65 - 10.3 * math.exp(-0.6 * 2)

# An echo is compared with this many cells on either side of its own, in range. The cells right next
# to it are left out, because they may hold an echo of the same object. Modelling choices.
REFERENCE_CELLS = 8
GUARD_CELLS = 2

# Rays per cell in azimuth and in inclination.
RAYS = 8


@dataclass(frozen=True)
class Radar:
    """A front-view 4D radar. The defaults are modelling choices of an automotive one.

    Attributes:
        azimuth: Right and left edge of the field of view, degrees from x towards y.
        inclination: Its lower and upper edge, degrees above the horizon.
        columns: Cells across the field of view.
        rows: Cells from its lower to its upper edge.
        range_cell: Depth of a cell, metres.
        minimum_range: Begin of the first cell, metres.
        maximum_range: Farther surfaces are not seen, metres.
        reach: Range at which the receiver's noise equals the echo of 1 m², metres; it grows with
            the fourth power of distance, as echoes get weaker.
        leakage: Leakage of the transmitter into every cell, as a radar cross-section, dBsm.
        false_alarm_rate: Probability that a cell of noise alone is a detection.
        accuracy: Standard deviation of a measured position, as a share of the cell.
        doppler_noise: Standard deviation of a measured speed, m/s.
        mounting_height: Height above the road, metres.
        frame_rate: Frames per second, Hz; as in REHEARSE-3D: 496 frames in 30 s.
    """

    azimuth: tuple[float, float] = (-50.0, 50.0)
    inclination: tuple[float, float] = (-8.0, 12.0)
    columns: int = 64
    rows: int = 8
    range_cell: float = 0.5
    minimum_range: float = 1.0
    maximum_range: float = 120.0
    reach: float = 250.0
    leakage: float = -35.0
    false_alarm_rate: float = 1e-4
    accuracy: float = 0.2
    doppler_noise: float = 0.1
    mounting_height: float = 0.6
    frame_rate: float = 16.5

    @property
    def shape(self) -> tuple[int, int, int]:
        """Cells by inclination (from the top), azimuth (from the left) and range."""
        depth = self.maximum_range - self.minimum_range
        return self.rows, self.columns, math.ceil(depth / self.range_cell)

    @property
    def cell(self) -> tuple[float, float, float]:
        """Size of a cell in inclination and azimuth, radians, and in range, metres."""
        (right, left), (lowest, highest) = self.azimuth, self.inclination
        height, width = math.radians(highest - lowest), math.radians(left - right)
        return height / self.rows, width / self.columns, self.range_cell

    def centres(self) -> list[Floats]:
        """Inclinations and azimuths (radians) and ranges (metres) of the cells' centres."""
        top, left = math.radians(self.inclination[1]), math.radians(self.azimuth[1])
        height, width, depth = self.cell
        edges_and_steps = (top, -height), (left, -width), (self.minimum_range, depth)
        return [
            np.asarray(edge + step * (np.arange(count) + 0.5), np.float64)
            for (edge, step), count in zip(edges_and_steps, self.shape, strict=True)
        ]

    def rays(self) -> Sensor:
        """A fan of rays, ``RAYS`` times as fine as the cells."""
        columns, rows = RAYS * self.columns, RAYS * self.rows
        (right, left), (lowest, highest) = self.azimuth, self.inclination
        aside, above = (left - right) / columns / 2, (highest - lowest) / rows / 2
        return Sensor(
            azimuth=(right + aside, left - aside),
            inclination=(lowest + above, highest - above),
            columns=columns,
            rows=rows,
            maximum_range=self.maximum_range,
            mounting_height=self.mounting_height,
        )


def mean_echoes(track: Track, rain: RainField, radar: Radar) -> Floats:
    """Mean echo of every class in every cell, the same in all frames: nothing on the track moves.

    Args:
        track: The track; the radar stands on it at the origin, at its height.
        rain: The rain.
        radar: The radar; its noise counts as background.

    Returns:
        Radar cross-section in m², float64 (classes, *radar.shape).

    Raises:
        InputError: Open3D cannot be imported.
    """
    _, _, distance = radar.centres()
    mean, farthest = surface_echoes(track, radar)
    mean[TrackClass.RAIN] += rain_echoes(rain, farthest, radar)
    mean[TrackClass.BACKGROUND] += 10 ** (radar.leakage / 10) + (distance / radar.reach) ** 4
    return mean


def detect(mean: Floats, radar: Radar, generator: Generator) -> Scan:
    """Makes one frame.

    Args:
        mean: A result of :func:`mean_echoes`.
        radar: The radar.
        generator: Random generator.

    Returns:
        The detections, in the radar's frame: ``fields`` has x, y, z (metres), doppler (m/s, along
        the line of sight, positive recedes) and rcs (dBsm), all float32. Labels are the TrackClass
        of the strongest return; noise is background.
    """
    inclination, azimuth, distance = radar.centres()
    echo = mean.sum(axis=0) * generator.exponential(size=radar.shape)
    found = echo > _threshold(echo, radar.false_alarm_rate)

    label = mean[:, found].argmax(axis=0)
    row, column, depth = np.nonzero(found)
    centre = np.stack([inclination[row], azimuth[column], distance[depth]])
    blur = radar.accuracy * np.array(radar.cell)[:, None]
    pitch, yaw, away = centre + blur * generator.normal(size=centre.shape)
    directions = np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)
    xyz = np.stack([away * direction for direction in directions], axis=1).astype(np.float32)
    # A drop falls straight down, and so comes nearer if it is above the radar.
    speed = np.where(label == TrackClass.RAIN, -FALL_SPEED * np.sin(pitch), 0.0)
    doppler = speed + generator.normal(0, radar.doppler_noise, len(label))
    fields = dict(zip("xyz", xyz.T, strict=True))
    fields["doppler"] = doppler.astype(np.float32)
    fields["rcs"] = (10 * np.log10(echo[found])).astype(np.float32)
    return Scan(xyz, label=label, fields=fields, name="radar frame")


def surface_echoes(track: Track, radar: Radar) -> tuple[Floats, Floats]:
    """Mean echo of the surfaces in every cell, and how far the radar sees.

    Args:
        track: The track.
        radar: The radar.

    Returns:
        Radar cross-section in m², float64 (classes, *radar.shape); and the distance of the farthest
        surface in each direction, float64 (rows, columns), metres, the maximum range in the open.
    """
    fan = radar.rays()
    hits = track.cast(fan)
    seen = hits.returned & (hits.range >= radar.minimum_range)
    distance, label = hits.range[seen], hits.label[seen]
    row, column = np.divmod(hits.beam[seen], fan.columns)
    height, width, depth = radar.cell
    inclination, _, _ = radar.centres()
    area = height * width / RAYS**2 * np.cos(inclination[row // RAYS]) * distance**2
    per_area = 10 ** (np.array([ECHO_PER_AREA[kind] for kind in TrackClass]) / 10)

    shape = (len(TrackClass), *radar.shape)
    along = ((distance - radar.minimum_range) / depth).astype(np.int64).clip(max=shape[-1] - 1)
    cell = np.ravel_multi_index((label, row // RAYS, column // RAYS, along), shape)
    echoes = np.bincount(cell, per_area[label] * area, math.prod(shape)).astype(np.float64)
    blocks = hits.range.reshape(radar.rows, RAYS, radar.columns, RAYS)
    return echoes.reshape(shape), blocks.max(axis=(1, 3))


def rain_echoes(rain: RainField, farthest: Floats, radar: Radar) -> Floats:
    """Mean echo of the rain in every cell.

    The radar looks almost level. The rain in a cell is therefore approximated by the rain over the
    ground at the cell's azimuth and range, independently of its inclination.

    Args:
        rain: The rain.
        farthest: Largest range in each direction, float64 (rows, columns), metres.
        radar: The radar.

    Returns:
        Radar cross-section in m², float64 of radar.shape.
    """
    inclination, azimuth, distance = radar.centres()
    ground = distance * np.cos(azimuth)[:, None], distance * np.sin(azimuth)[:, None]
    height, width, depth = radar.cell
    near, far = distance - depth / 2, distance + depth / 2
    volume = height * width * np.cos(inclination)[:, None, None] * (far**3 - near**3) / 3
    echo = volume * volume_reflectivity(rain.rate(*ground))
    return np.where(distance < farthest[..., None], echo, 0.0)


def volume_reflectivity(rate: Floats) -> Floats:
    """Radar cross-section of a cubic metre of rain at 77 GHz, m² per m³.

    The cross-section of all its drops, π/4 ∫ D² N(D) dD, times their backscatter efficiency.

    Args:
        rate: Rain rate, mm/h, float64 of any shape.
    """
    return BACKSCATTER_EFFICIENCY * extinction(rate) / EXTINCTION_EFFICIENCY


def _threshold(echo: Floats, false_alarm_rate: float) -> Floats:
    """The threshold of a cell's echo: a multiple of the mean of its reference cells.

    Source: Finn and Johnson 1968, "Adaptive detection mode with threshold control as a function of
    spatially sampled clutter-level estimates" (cell-averaging CFAR).
    """
    side = np.repeat([1.0, 0.0], [REFERENCE_CELLS, GUARD_CELLS])
    window = np.concatenate([side, [0.0], side[::-1]])
    beyond = len(side)  # the first and last cells have their neighbours on both sides mirrored
    padded = np.pad(echo, ((0, 0), (0, 0), (beyond, beyond)), mode="reflect")
    neighbours = np.lib.stride_tricks.sliding_window_view(padded, len(window), axis=-1)
    return np.asarray((false_alarm_rate ** (-1 / window.sum()) - 1) * (neighbours @ window))
