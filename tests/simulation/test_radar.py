"""The radar against closed forms: echoes, false alarms, detections, and rain hardly seen."""

import math
from dataclasses import replace

import numpy as np
import pytest

from derain.scan import Ints, Scan
from derain.simulation import shapes
from derain.simulation.classes import TrackClass
from derain.simulation.facility import lay_out_track
from derain.simulation.objects import Surface
from derain.simulation.radar import (
    ECHO_PER_AREA,
    FALL_SPEED,
    REFERENCE_CELLS,
    Radar,
    detect,
    mean_echoes,
    rain_echoes,
    surface_echoes,
    volume_reflectivity,
)
from derain.simulation.rain_field import RainField, SprinkledRain, UniformRain
from derain.simulation.sensor import unit_vectors
from derain.simulation.track import Track

pytestmark = pytest.mark.usefixtures("open3d")

DRY = UniformRain(0)
HEAVY = UniformRain(50)
# Few cells, so that many frames are made in a second.
NARROW = Radar(azimuth=(-6, 6), inclination=(-4, 4), columns=8, rows=4)


def plate(x: float, width: float, y: float = 0.0, height: float = 0.6) -> Surface:
    """A square target facing the sensor at a distance in metres, its centre at a height."""
    box = shapes.box(0.01, width, height - width / 2, height + width / 2)
    return Surface(box, TrackClass.TARGET, 0.5).placed(x, y)


def in_cell(radar: Radar, row: int, column: int, depth: int, width: float) -> Track:
    """A square target in the middle of a cell."""
    inclination, azimuth, distance = radar.centres()
    (direction,) = unit_vectors(np.degrees(azimuth[column]), np.degrees(inclination[row]))
    x, y, height = distance[depth] * direction + (0, 0, radar.mounting_height)
    return Track.of([plate(x, width, y, height)])


# Nothing in sight: what is there is behind the radar.
OPEN = Track.of([plate(-50, 1)])


def frames(track: Track, radar: Radar, count: int, rain: RainField = DRY) -> list[Scan]:
    generator = np.random.default_rng(0)
    mean = mean_echoes(track, rain, radar)
    return [detect(mean, radar, generator) for _ in range(count)]


def labels(scans: list[Scan]) -> Ints:
    return np.concatenate([scan.label for scan in scans if scan.label is not None])


def test_the_echo_of_a_plate_is_in_proportion_to_its_area_at_any_distance() -> None:
    per_area = 10 ** (ECHO_PER_AREA[TrackClass.TARGET] / 10)
    for x, width in ((15, 1), (15, 2), (40, 2), (80, 4)):
        echo, _ = surface_echoes(Track.of([plate(x, width)]), Radar())
        assert echo.sum() == pytest.approx(per_area * width**2, rel=0.15)
        assert echo[TrackClass.TARGET].sum() == echo.sum()


def test_an_echo_lies_in_the_cell_that_its_surface_lies_in() -> None:
    radar = Radar()
    echo, farthest = surface_echoes(in_cell(radar, 3, 20, 80, 0.3), radar)
    assert np.argwhere(echo).tolist() == [[TrackClass.TARGET, 3, 20, 80]]
    assert (farthest == radar.maximum_range).all()  # the plate does not fill its cell


def test_the_rain_fills_every_cell_up_to_what_blocks_the_view() -> None:
    radar = replace(NARROW, maximum_range=61)
    farthest = np.full((4, 8), radar.maximum_range)
    rate = volume_reflectivity(np.array(50.0))
    width, height = math.radians(12), 2 * math.sin(math.radians(4))
    volume = width * height * (61**3 - 1) / 3
    assert rain_echoes(HEAVY, farthest, radar).sum() == pytest.approx(rate * volume, rel=1e-3)
    blocked = rain_echoes(HEAVY, farthest / 2, radar)
    assert blocked.sum() == pytest.approx(rate * volume / 8, rel=0.03)
    assert not rain_echoes(DRY, farthest, radar).any()


@pytest.mark.parametrize("rain", [DRY, HEAVY], ids=["dry", "heavy rain"])
def test_false_alarms_are_as_rare_as_stated_whether_or_not_it_rains(rain) -> None:
    radar = replace(NARROW, false_alarm_rate=2e-3)
    scans = frames(OPEN, radar, 60, rain)
    cells = math.prod(radar.shape)
    expected = 60 * cells * radar.false_alarm_rate
    found = labels(scans)
    assert len(found) == pytest.approx(expected, abs=4 * math.sqrt(expected) + 0.05 * expected)
    if rain is DRY:
        assert (found == TrackClass.BACKGROUND).all()
    else:
        assert set(found) == {TrackClass.BACKGROUND, TrackClass.RAIN}


@pytest.mark.parametrize("reach", [90, 120, 200])
def test_a_target_is_detected_as_often_as_by_the_closed_form(reach) -> None:
    # An isolated Swerling 1 target of a signal S times the noise, by cell-averaging CFAR over N
    # cells: (1 + T / (1 + S))^-N where T = P^(-1/N) - 1 for a false alarm rate of P.
    # Source: Finn and Johnson 1968.
    radar = replace(NARROW, reach=reach, leakage=-100.0)
    track = in_cell(radar, 2, 4, 80, 0.4)
    echo, _ = surface_echoes(track, radar)
    assert np.argwhere(echo)[:, 3].tolist() == [80]
    signal = echo.sum() / (radar.centres()[2][80] / reach) ** 4
    cells = 2 * REFERENCE_CELLS
    threshold = radar.false_alarm_rate ** (-1 / cells) - 1
    expected = (1 + threshold / (1 + signal)) ** -cells
    rate = (labels(frames(track, radar, 300)) == TrackClass.TARGET).sum() / 300
    assert 0.03 < expected < 0.97
    assert rate == pytest.approx(expected, abs=4 * math.sqrt(expected * (1 - expected) / 300))


def test_positions_are_off_by_a_share_of_the_cell() -> None:
    radar = replace(NARROW, accuracy=0.1)
    inclination, azimuth, distance = radar.centres()
    scans = frames(in_cell(radar, 1, 2, 60, 0.3), radar, 300)
    points = np.concatenate([scan.xyz[scan.label == TrackClass.TARGET] for scan in scans])
    range_ = np.linalg.norm(points, axis=1)
    azimuths = np.arctan2(points[:, 1], points[:, 0])
    measured = np.stack([np.arcsin(points[:, 2] / range_), azimuths, range_])
    centre = np.array([inclination[1], azimuth[2], distance[60]])
    error = (measured - centre[:, None]) / np.array(radar.cell)[:, None]
    assert len(points) > 200
    np.testing.assert_allclose(error.mean(axis=1), 0, atol=0.03)
    np.testing.assert_allclose(error.std(axis=1), 0.1, rtol=0.2)


def test_the_scene_stands_and_the_rain_falls() -> None:
    scans = frames(lay_out_track(np.random.default_rng(0)), Radar(), 3)
    scans += frames(OPEN, replace(Radar(), false_alarm_rate=3e-3), 5, HEAVY)
    doppler = np.concatenate([scan.fields["doppler"] for scan in scans])
    label = labels(scans)
    still = doppler[label != TrackClass.RAIN]
    assert abs(still.mean()) < 0.02
    assert still.std() == pytest.approx(Radar().doppler_noise, rel=0.1)
    drops = np.concatenate([scan.xyz for scan in scans])[label == TrackClass.RAIN]
    sine = drops[:, 2] / np.linalg.norm(drops, axis=1)
    slope, offset = np.polyfit(sine, doppler[label == TrackClass.RAIN], 1)
    assert len(drops) > 50
    assert pytest.approx(6.5, abs=0.1) == FALL_SPEED
    assert slope == pytest.approx(-FALL_SPEED, abs=1)
    assert offset == pytest.approx(0, abs=0.1)


def test_a_frame_of_a_street_has_hundreds_of_detections_and_hardly_any_rain() -> None:
    track = lay_out_track(np.random.default_rng(0))
    rainy, dry = frames(track, Radar(), 15, SprinkledRain(50)), frames(track, Radar(), 15)
    for scan in [*rainy, *dry]:
        assert 100 < len(scan) < 500
        assert list(scan.fields) == ["x", "y", "z", "doppler", "rcs"]
        assert {values.dtype for values in scan.fields.values()} == {np.dtype(np.float32)}
        assert np.array_equal(np.stack([scan.fields[axis] for axis in "xyz"], axis=1), scan.xyz)
    assert 0 < (labels(rainy) == TrackClass.RAIN).mean() < 0.01
    assert len(labels(rainy)) > 0.9 * len(labels(dry))
    assert {TrackClass.BACKGROUND, TrackClass.CAR} < set(labels(dry)) < set(TrackClass)
    assert not np.array_equal(dry[1].xyz[:100], dry[0].xyz[:100])
