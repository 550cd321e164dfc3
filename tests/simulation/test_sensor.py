"""The sensor's beams and its measurement."""

import math

import numpy as np
import pytest

from derain.simulation.sensor import Returns, Sensor

SENSOR = Sensor(rows=20, columns=50)
BEAMS = SENSOR.rows * SENSOR.columns


def returns(generator: np.random.Generator) -> Returns:
    seen = generator.random(BEAMS) < 0.8
    return Returns(
        np.where(seen, generator.uniform(2, 100, BEAMS), SENSOR.maximum_range),
        np.where(seen, generator.uniform(0.01, 1, BEAMS), 0),
        np.where(seen, generator.integers(0, 8, BEAMS), 0),
    )


def test_beams_are_unit_vectors_over_the_field_of_view_from_top_left_to_bottom_right() -> None:
    beams = SENSOR.beams()
    assert beams.shape == (BEAMS, 3)
    assert np.allclose(np.linalg.norm(beams, axis=1), 1)
    azimuth = np.degrees(np.arctan2(beams[:, 1], beams[:, 0])).reshape(SENSOR.rows, -1)
    inclination = np.degrees(np.arcsin(beams[:, 2])).reshape(SENSOR.rows, -1)
    assert np.allclose(azimuth, np.linspace(57.5, -57.5, SENSOR.columns))
    assert np.allclose(inclination, np.linspace(7.5, -17.5, SENSOR.rows)[:, None])


def test_the_volume_of_a_beam_is_the_integral_over_its_cross_section() -> None:
    distance = np.linspace(2, 50, 100_001)
    radius = distance * math.tan(SENSOR.beam_divergence / 2)
    integral = np.trapezoid(np.pi * radius**2, distance)
    assert SENSOR.beam_volume(2, np.array([50.0])) == pytest.approx(integral)


def test_a_scan_holds_the_beams_that_returned_in_their_order() -> None:
    given = returns(np.random.default_rng(1))
    scan = SENSOR.measure(given, np.random.default_rng(2))
    assert len(scan) == np.count_nonzero(given.returned) < BEAMS
    assert scan.label is not None
    assert (scan.label == given.label[given.returned]).all()
    direction = scan.xyz / np.linalg.norm(scan.xyz, axis=1, keepdims=True)
    assert np.allclose(direction, SENSOR.beams()[given.returned], atol=1e-6)


def test_measured_distance_and_intensity_scatter_as_stated() -> None:
    generator = np.random.default_rng(3)
    given = returns(generator)
    error, ratio = [], []
    for _ in range(50):
        scan = SENSOR.measure(given, generator)
        assert scan.intensity is not None
        error.append(scan.range - given.range[given.returned])
        ratio.append(scan.intensity / (255 * given.reflectivity[given.returned]))
    assert np.mean(error) == pytest.approx(
        0, abs=4 * SENSOR.range_noise / math.sqrt(50 * BEAMS / 2)
    )
    assert np.std(error) == pytest.approx(SENSOR.range_noise, rel=0.05)
    grey = (given.reflectivity[given.returned] > 0.2) & (given.reflectivity[given.returned] < 0.5)
    assert np.mean(np.array(ratio)[:, grey]) == pytest.approx(1, abs=0.01)
    assert np.std(np.array(ratio)[:, grey]) == pytest.approx(SENSOR.intensity_noise, rel=0.05)


def test_intensity_stays_within_its_scale() -> None:
    extreme = Returns(np.full(BEAMS, 5.0), np.tile([1e-4, 1.0], BEAMS // 2), np.zeros(BEAMS, int))
    scan = SENSOR.measure(extreme, np.random.default_rng(4))
    assert scan.intensity is not None
    assert scan.intensity.min() == 0
    assert scan.intensity.max() == 255
    assert scan.intensity.dtype == scan.xyz.dtype == np.float32
