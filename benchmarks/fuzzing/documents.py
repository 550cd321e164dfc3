"""Small documents of every kind that a user gives."""

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import astuple
from pathlib import Path
from random import Random

import numpy as np
import yaml

from benchmarks.fuzzing.mutations import as_json, changed
from benchmarks.fuzzing.reader import Reader
from derain.annotation.manifest import LABELS, TAUGHT_PARTS, Manifest
from derain.annotation.scene import read_scene
from derain.cards.card import load_card, packaged_cards
from derain.evaluation.hard_cases import scene
from derain.export.methods import read_parameters
from derain.files.documents import Entry
from derain.files.extrinsics import moved, read_extrinsics
from derain.files.frame_times import read_frame_times
from derain.filters import FILTERS, FilterDerainer, filter_from
from derain.simulation.arrays import Returns
from derain.simulation.campaign import Campaign
from derain.simulation.drawn_sensor import SensorSpans, draw_sensor
from derain.simulation.manifest import MANIFEST, rates_of_sequences, read_manifest
from derain.simulation.sensor import Sensor, load_sensor, packaged_sensors

SCENE = """
height: 0.1
road: [[2, -4], [60, -4], [60, 4], [2, 4]]
rain_area: [[2, -9], [60, -9], [60, 9], [2, 9]]
boxes:
  car_1: {class: car, centre: [20, 1, -0.6], size: [4.5, 1.8, 1.5], heading: 5}
  mast_1: {class: sprinkler, centre: [8, 4.5, 0.7], size: [0.3, 0.3, 4]}
corrections:
  "003": {boxes: {car_1: {shift: [0.2, 0, 0]}}}
"""
CARD = """
name: yard
classes: {0: ground, 3: rain, 4: spray, 255: unknown}
rain: [3, 4]
unknown: [255]
mean: [1, 2, 3, 4]
std: [5.0, 6.0, 7.0, 8.0]
range: [9, 10]
extra: {doppler: [-0.5, 2]}
rain_share: 0.25
simulated: true
split: {train: ["00", "010"], validation: [], test: ["008"]}
layout: {sequences: drives, scans: lidar, labels: truth, lidar: alone}
auto_detect: classes
"""
EXTRINSICS = (
    "{x: 0.5, y: 0.0, z: -0.7, roll: 0, pitch: 0, yaw: 1.5}",
    "matrix: [[1, 0, 0, 0.5], [0, 1, 0, 0], [0, 0, 1, -0.7], [0, 0, 0, 1]]",
)
TAUGHT = """made_by: derain.teaching
derain: 0.1.0
teacher: {method: persistence, reach: 0.6, candidates: {bounds: [{channel: range, most: 30.0}]}}
columns: [x, y, z, intensity]
intensity_scale: 255.0
finished: true
scans:
- {key: '000000', scan: ../drive/000000.bin, sequence: drive, number: 0, part: train}
- {key: a/000001, scan: /drives/000001.bin, sequence: drive, number: 1, part: validation}
"""
SENSOR = """\
pattern: rosette
rows: 2
columns: 50
row_inclinations: [0.2, -0.2]
row_azimuths: [1.5, -1.5]
prism_turns: [12.5, -7.5]
tilt: [1.5, -12.0]
range_noise_growth: 1.0e-3
weak_range_noise: 0.05
encoder_noise: 0.02
returns: dual
defects: {dropped: 0.1, dropped_rows: 0.1, dropped_sectors: 0.1, mixed: 0.5, merging: 2.0,
  range_step: 0.004, copies: 0.5}
"""
SPANS = """\
kinds: {spinning: 2, front: 1, rosette: 0.5}
returns: {strongest: 1, dual: 1}
spinning_rows: [16, 32]
spinning_field: [20, 60]
azimuth_step: [0.5, 1.0]
most_beams: 20000
tilt: [0, 3]
defects: {none: 0.2, dropped: [0.0, 0.3], merging: [0.5, 2.0]}
"""
TIMES = "frame,timestamp,other\n000000,1.5,a\n000001.bin,1.6,b\n000002,1.7,\n"


def readers() -> list[Reader]:
    """One for each kind of document."""
    sensors = [path.read_text() for path in packaged_sensors().values()]
    filters = [
        yaml.safe_dump({"method": name, **filter_from(name, {}).as_dict()}) for name in FILTERS
    ]
    files = {"sequences/000/lidar_radar_pcd/000000.bin": 64 * "0"}
    manifest = {**Campaign().description, "files": files}
    return [
        _of_yaml("card", _read_card, [CARD, packaged_cards()["wads"].read_text()]),
        _of_yaml("scene", _read_scene, [SCENE]),
        _of_yaml("extrinsics", _read_extrinsics, EXTRINSICS),
        _of_yaml("parameters", _read_parameters, filters),
        _of_yaml("rates", _read_rates, ['"005": 25\n"010": 10.5\n']),
        _of_yaml("sensor", _read_sensor, [*sensors, SENSOR]),
        _of_yaml("spans", _read_spans, [SPANS]),
        _of_yaml("taught", _read_taught, [TAUGHT]),
        Reader(
            "manifest",
            MANIFEST,
            _read_manifest,
            lambda: [as_json(manifest)],
            [
                lambda: b"[" * 100_000,
                lambda: b'{"made_by": ' + b"9" * 5000,
                lambda: as_json({**manifest, "files": [*files]}),
            ],
            lambda generator: as_json(changed(manifest, generator)),
        ),
        Reader("times", "metadata.csv", _read_times, lambda: [TIMES.encode()]),
    ]


def _of_yaml(name: str, read: Callable[[Path], object], texts: Sequence[str]) -> Reader:
    def change(generator: Random) -> bytes:
        content = changed(yaml.safe_load(generator.choice(texts)), generator)
        if generator.random() < 0.5:
            return as_json(content)
        return str(yaml.safe_dump(content, allow_unicode=True)).encode("utf-8", "surrogatepass")

    return Reader(
        name, f"{name}.yaml", read, lambda: [text.encode() for text in texts], _HOSTILE, change
    )


def _aliases() -> bytes:
    """Nine aliases of nine aliases of nine: half a gigabyte, were it written out."""
    lines = ["a: &a [x, x, x, x, x, x, x, x, x]"]
    for before, name in zip("abcdefgh", "bcdefghi", strict=True):
        lines.append(f"{name}: &{name} [{', '.join([f'*{before}'] * 9)}]")
    return "\n".join(lines).encode()


_HOSTILE: Sequence[Callable[[], bytes]] = (
    _aliases,
    lambda: b"&a [*a]",
    lambda: b"[" * 10_000,
    lambda: b"{a: " * 500 + b"1" + b"}" * 500,
    lambda: b"!!python/object/apply:os.system [true]",
    lambda: b"!!int ''",
    lambda: b"2001-13-45",
    lambda: b"a: " + b"9" * 5000,
    lambda: b"a: " + b"1:" * 200 + b"1.0",
    lambda: b"a: 0x" + b"f" * 5000,
    lambda: b"[" + b"[]," * 300_000 + b"0]",
)


def _read_card(path: Path) -> None:
    card = load_card(path)
    assert set(card.rain) <= set(card.classes)
    assert not set(card.unknown) & set(card.rain)
    assert math.isfinite(card.rain_share or 0)
    for mean, std in card.moments.values():
        assert math.isfinite(mean)
        assert 0 < std < math.inf


def _read_scene(path: Path) -> None:
    read = read_scene(path)
    points = scene(40).astype(np.float64)
    for sequence in ("", *read.corrections):
        for box in read.in_sequence(sequence).boxes.values():
            assert box.contains(points[:, :3]).shape == (40,)


def _read_extrinsics(path: Path) -> None:
    motion = read_extrinsics(path)
    rotation = motion[:3, :3]
    assert np.abs(rotation @ rotation.T - np.eye(3)).max() < 0.01
    assert not np.isnan(moved(scene(40)[:, :3], motion)).any()


def _read_parameters(path: Path) -> None:
    method, parameters = read_parameters(path)
    rain = FilterDerainer(filter_from(method, parameters), threads=1)(scene(40))
    assert rain.dtype == bool
    assert rain.shape == (40,)


def _read_rates(path: Path) -> None:
    assert all(map(math.isfinite, rates_of_sequences(Entry.of_yaml(path)).values()))


def _read_sensor(path: Path) -> None:
    sensor = load_sensor(path)
    numbers = np.hstack(astuple(sensor)[:3])
    assert np.isfinite(numbers).all(), numbers
    if sensor.rows * sensor.columns < 10**5:
        _measure(sensor)


def _read_spans(path: Path) -> None:
    sensor = draw_sensor(SensorSpans.of(Entry.of_yaml(path)), np.random.default_rng(0))
    if sensor.rows * sensor.columns < 10**5:
        _measure(sensor)


def _measure(sensor: Sensor) -> None:
    beams = len(sensor.beams())
    range_ = np.linspace(sensor.minimum_range, sensor.maximum_range, beams)
    returns = Returns(range_, np.full(beams, 0.5), np.zeros(beams, np.int64), np.arange(beams))
    scan = sensor.measure(returns, np.random.default_rng(0))
    assert np.isfinite(sensor.beams()).all()
    assert not np.isnan(scan.xyz).any()


def _read_manifest(path: Path) -> None:
    manifest = read_manifest(path.parent)
    assert all(map(math.isfinite, manifest.get("rain_rate_mm_h", {}).values()))
    for sequences in manifest.get("split", {}).values():
        assert all(isinstance(name, str) for name in sequences)


def _read_taught(path: Path) -> None:
    manifest = Manifest.read(path.parent)
    for part in TAUGHT_PARTS:
        for frame in manifest.frames(path.parent, part):
            assert path.parent / LABELS in Path(os.path.normpath(frame.label_path)).parents
            assert frame.path.is_absolute()
            assert math.isfinite(frame.intensity_scale)


def _read_times(path: Path) -> None:
    names = ("000000.bin", "000001.bin", "000002.bin")
    assert np.isfinite(read_frame_times([path.with_name(name) for name in names])).all()
