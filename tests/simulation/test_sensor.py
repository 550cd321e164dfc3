"""The sensor's beams and its measurement."""

import json
import math
from dataclasses import asdict, replace

import numpy as np
import pytest

from derain.errors import InputError
from derain.scan import Floats
from derain.simulation.sensor import Sensor, load_sensor, packaged_sensors

from .surfaces import random_surfaces, surfaces

SENSOR = Sensor(rows=20, columns=50)
BEAMS = SENSOR.rows * SENSOR.columns

# Attributes that a packaged sensor states only where it differs from the defaults.
NOT_ALWAYS_STATED = {
    *("row_inclinations", "row_azimuths", "pattern", "prism_turns", "tilt", "defects"),
    *("range_noise_growth", "weak_range_noise", "encoder_noise"),
}


def angles(sensor: Sensor) -> tuple[Floats, Floats]:
    """Azimuths and inclinations of its beams, degrees, float64 (rows, columns) each."""
    x, y, z = sensor.beams().T
    shape = sensor.rows, sensor.columns
    return np.degrees(np.arctan2(y, x)).reshape(shape), np.degrees(np.arcsin(z)).reshape(shape)


def test_rows_and_columns_lie_where_they_are_stated_and_no_direction_comes_twice() -> None:
    assert np.allclose(np.linalg.norm(SENSOR.beams(), axis=1), 1)
    azimuth, inclination = angles(SENSOR)
    assert np.allclose(azimuth, np.linspace(57.5, -57.5, SENSOR.columns))
    assert np.allclose(inclination, np.linspace(7.5, -17.5, SENSOR.rows)[:, None])
    tables = {"row_inclinations": (5.0, 0.0, -12.0), "row_azimuths": (0.0, 2.5, -1.0)}
    sensor = replace(SENSOR, azimuth=(-180, 180), rows=3, columns=8, **tables)
    azimuth, inclination = angles(sensor)
    expected = 180 - 45 * np.arange(8) + np.array(sensor.row_azimuths)[:, None]
    assert np.allclose((azimuth - expected + 180) % 360, 180)
    assert np.allclose(inclination, np.array(sensor.row_inclinations)[:, None])


def test_a_sensor_that_pitches_looks_down_ahead_and_one_that_rolls_looks_up_to_its_left() -> None:
    level = replace(SENSOR, azimuth=(0, 90), inclination=(0, 10), rows=2, columns=2)
    _, pitched = angles(replace(level, tilt=(0, 20)))
    _, rolled = angles(replace(level, tilt=(5, 0)))
    assert np.allclose(pitched[:, 1], (-10, -20))  # straight ahead
    assert np.allclose(rolled[:, 0], (15, 5))  # to the left
    assert np.allclose(pitched[1, 0], 0)  # along the axis that it turns about
    assert np.allclose(rolled[1, 1], 0)


def test_a_tilted_sensor_reports_in_its_own_frame() -> None:
    tilted = replace(SENSOR, tilt=(3.0, -8.0))
    given = random_surfaces(BEAMS, np.random.default_rng(1))
    own = tilted.measure(given, np.random.default_rng(2))
    assert (own.xyz == SENSOR.measure(given, np.random.default_rng(2)).xyz).all()
    direction = own.xyz / np.linalg.norm(own.xyz, axis=1, keepdims=True)
    level = direction @ tilted.mounting[:3, :3].T
    assert np.allclose(level, tilted.beams()[given.returned], atol=1e-6)


def test_the_shots_of_a_rosette_fill_its_ellipse_and_no_more() -> None:
    field = {"azimuth": (-30, 30), "inclination": (-15, 25)}
    turns = (42.1, -27.3)
    sensor = Sensor(pattern="rosette", prism_turns=turns, rows=1, columns=20_000, **field)
    (azimuth,), (inclination,) = angles(sensor)
    across, up = azimuth / 30, (inclination - 5) / 20
    radius = np.hypot(across, up)
    assert radius.max() == pytest.approx(1)
    # Within the ellipse there is a shot near every place.
    places = np.random.default_rng(0).uniform(-0.7, 0.7, (300, 2))
    distance = np.hypot(across - places[:, :1], up - places[:, 1:]).min(axis=1)
    assert distance.max() < 0.05


def test_lasers_of_a_rosette_share_a_curve_or_lie_beside_each_other() -> None:
    rosette = Sensor(pattern="rosette", azimuth=(-20, 20), inclination=(-20, 20), rows=1)
    alone = replace(rosette, columns=600).beams()
    together = replace(rosette, rows=3, columns=200).beams().reshape(3, 200, 3)
    assert np.allclose(together.swapaxes(0, 1).reshape(-1, 3), alone)
    offsets = (0.4, 0.0, -0.4)
    _, inclination = angles(replace(rosette, rows=3, columns=200, row_inclinations=offsets))
    assert np.allclose(inclination - inclination[1], np.array(offsets)[:, None])


def test_noise_grows_with_distance_and_for_weak_returns() -> None:
    sensor = replace(SENSOR, range_noise=0.03, range_noise_growth=0.001, weak_range_noise=0.2)
    count, generator = 40_000, np.random.default_rng(5)
    near, far = np.full(count, 1.0), np.full(count, 100.0)
    strong = np.full(count, 4 * sensor.detection_threshold)
    for distance, power, deviation in (
        (near, None, math.hypot(0.03, 0.001)),
        (far, None, math.hypot(0.03, 0.1)),
        (near, strong, math.hypot(0.03, 0.001, 0.2 / 2)),
        (near, strong / 4, math.hypot(0.03, 0.001, 0.2)),
        (near, strong / 16, math.hypot(0.03, 0.001, 0.2)),
    ):
        error = sensor.measured_range(distance, generator, power) - distance
        assert error.std() == pytest.approx(deviation, rel=0.02)


def test_the_encoder_turns_all_of_a_column_alike() -> None:
    sensor = replace(SENSOR, encoder_noise=0.05, range_noise=0.0, columns=2000, rows=4)
    beams = 4 * 2000
    xyz = sensor.measure(surfaces(beams, 10.0, 0.5), np.random.default_rng(0)).xyz.astype(float)
    turn = np.degrees(np.arctan2(xyz[:, 1], xyz[:, 0])).reshape(4, 2000)
    turn -= np.linspace(57.5, -57.5, 2000)
    assert np.allclose(turn, turn[0], atol=1e-4)
    assert turn[0].std() == pytest.approx(0.05, rel=0.1)


def test_a_scan_holds_the_beams_that_returned_in_their_order_with_noise_as_stated() -> None:
    generator = np.random.default_rng(3)
    given = random_surfaces(BEAMS, generator)
    seen = given.returned
    error, ratio = [], []
    for _ in range(50):
        scan = SENSOR.measure(given, generator)
        assert len(scan) == np.count_nonzero(seen) < BEAMS
        assert (scan.label == given.label[seen]).all()
        direction = scan.xyz / np.linalg.norm(scan.xyz, axis=1, keepdims=True)
        assert np.allclose(direction, SENSOR.beams()[seen], atol=1e-6)
        error.append(scan.range - given.range[seen])
        ratio.append(scan.intensity / (255 * given.reflectivity[seen]))
    assert np.mean(error) == pytest.approx(0, abs=4 * SENSOR.range_noise / math.sqrt(25 * BEAMS))
    assert np.std(error) == pytest.approx(SENSOR.range_noise, rel=0.05)
    grey = (given.reflectivity[seen] > 0.2) & (given.reflectivity[seen] < 0.5)
    assert np.mean(np.array(ratio)[:, grey]) == pytest.approx(1, abs=0.01)
    assert np.std(np.array(ratio)[:, grey]) == pytest.approx(SENSOR.intensity_noise, rel=0.05)


def test_intensity_stays_within_its_scale() -> None:
    extreme = surfaces(BEAMS, 5.0, 1e-4)
    extreme.reflectivity[::2] = 1.0
    scan = SENSOR.measure(extreme, np.random.default_rng(4))
    assert scan.intensity.min() == 0
    assert scan.intensity.max() == 255
    assert scan.intensity.dtype == scan.xyz.dtype == np.float32


def test_every_packaged_sensor_is_written_out_in_full_and_survives_json(tmp_path) -> None:
    for name in packaged_sensors():
        stated = set(packaged_sensors()[name].read_text().replace(":", " ").split())
        assert set(asdict(Sensor())) - NOT_ALWAYS_STATED <= stated
        path = tmp_path / "again.yaml"
        path.write_text(json.dumps(asdict(load_sensor(name))))  # JSON is YAML
        assert load_sensor(path) == load_sensor(name)


def test_a_sensor_file_states_what_differs_from_the_defaults(tmp_path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("rows: 32\nreturns: dual\nazimuth: [-180, 180]\n")
    assert load_sensor(path) == Sensor(rows=32, returns="dual", azimuth=(-180, 180))
    assert load_sensor("mems_64") == Sensor()


@pytest.mark.parametrize(
    "content",
    [
        *("rows: 0", "rows: 64.5", "rows: 1000000000", "rows: 100000\ncolumns: 100000"),
        *("azimuth: [10, -10]", "azimuth: [-200, 200]", "azimuth: 5", "azimuth: [0, [0]]"),
        *("inclination: [5]", "tilt: [0, 91]", "columns: -1", "row_inclinations: {}"),
        *("rows: 3\nrow_inclinations: [1, 2]", "rows: 2\nrow_azimuths: [0, 1000]"),
        *("minimum_range: .nan", "maximum_range: .inf", f"maximum_range: 1{'0' * 400}"),
        *("detection_threshold: '4e-6'", "frame_rate: 0", "encoder_noise: 1000"),
        *("range_noise_growth: -1", "prism_turns: [1.0e+300, 1]", "pattern: circle"),
        *("returns: first", "returns: [strongest]", "colour: red"),
        *("defects: 3", "defects: {dropped: 2}", "defects: {rusty: 0.1}"),
        *("- rows", "rows: [", "just text", ""),
    ],
)
def test_a_file_that_describes_no_sensor_is_refused(content, tmp_path) -> None:
    path = tmp_path / "broken.yaml"
    path.write_text(content)
    with pytest.raises(InputError, match=r"broken\.yaml: ") as refusal:
        load_sensor(path)
    assert len(str(refusal.value)) < len(str(path)) + 400
    with pytest.raises(InputError, match="mems_256"):
        load_sensor("mems_257")
