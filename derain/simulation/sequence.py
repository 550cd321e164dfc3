"""Writes one simulated sequence: the folders of REHEARSE-3D that carry points, labels or weather.

innoviz/000000.bin               a scan of the LiDAR: float32 x, y, z (m), intensity (0..255)
radar_pcd/000000.bin             a frame of the radar: float32 x, y, z (m), intensity (SNR in dB)
ext_radar/000000.csv             the same, with all that the radar measured
lidar_radar_pcd/000000.bin       each scan, joined by the radar frame nearest in time
lidar_radar_labels/000000.label  uint32 TrackClass per point of it
weather/000000.csv               the weather during each scan, by rain_field.weather_record
extrinsics.yaml                  takes points of radar_pcd and ext_radar to the LiDAR's frame

Each folder also holds metadata.csv: frame, timestamp (seconds from the start). Without a radar its
files are missing, and lidar_radar_pcd holds the LiDAR's scans alone.

Of a drive, both folders of scans hold poses.txt: a line a scan, the upper three rows of the motion
that takes its points to the frame of the first scan, both as the scans begin. The upper 16 bits of
a label are then the number of a moving car or pedestrian, from 1 on; 0 is what stands, and rain.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.random import Generator
from numpy.typing import ArrayLike

from derain.cards.card import load_card
from derain.files import write_scan
from derain.files.atomic import replacing, write_text
from derain.files.extrinsics import POSE, motion_of_pose
from derain.files.frame_times import FRAME_COLUMNS, METADATA
from derain.files.labels import write_labels
from derain.fusion import NO_DETECTIONS, fuse, nearest_in_time
from derain.scan import Floats, Scan, to_float32
from derain.simulation.campaign import Campaign
from derain.simulation.classes import unpacked
from derain.simulation.radar import Radar, detect, mean_echoes
from derain.simulation.rain import rain_on_beams
from derain.simulation.scene import SimulatedScene
from derain.simulation.sensor import Sensor
from derain.sources.records import POSES

# What the folders of a sequence are called.
FOLDERS = load_card("simulated").layout


def write_sequence(folder: Path, campaign: Campaign, name: str) -> None:
    """Simulates a sequence.

    Args:
        folder: Folder to write.
        campaign: The campaign of the sequence.
        name: Name of the sequence.

    Raises:
        InputError: A file cannot be written, or Open3D cannot be imported.
    """
    # The radar has a random generator of its own, so that the LiDAR sees the same without it.
    seeds = np.random.SeedSequence(campaign.seed, spawn_key=(int(name),)).spawn(3)
    scene_generator, lidar_generator, radar_generator = map(np.random.default_rng, seeds)
    scene, sensor = SimulatedScene.of(campaign, name, scene_generator), campaign.lidar
    times = campaign.times
    beside = [NO_DETECTIONS] * len(times)
    mounting = np.eye(4)
    if campaign.radar is not None:
        mounting = _write_mounting(folder, campaign.radar, sensor)
        beside = _record_radar(folder, scene, campaign.radar, times, radar_generator)
    beams, clear_air = sensor.beams(), scene.cast(sensor, times)
    for stem, clear, frame in zip(_stems(len(times)), clear_air, beside, strict=True):
        detected = rain_on_beams(clear, beams, scene.rain, sensor, lidar_generator)
        scan = sensor.measure(detected, lidar_generator)
        joined = fuse(scan, frame, mounting)
        assert joined.label is not None  # as both of its parts are labelled
        write_scan(folder / FOLDERS.lidar / f"{stem}.bin", scan)
        write_scan(folder / FOLDERS.scans / f"{stem}.bin", joined)
        write_labels(folder / FOLDERS.labels / f"{stem}.label", *unpacked(joined.label))
        _write_table(folder / "weather" / f"{stem}.csv", scene.weather)
    for kind in (FOLDERS.lidar, FOLDERS.scans, FOLDERS.labels, "weather"):
        _write_times(folder / kind, times)
    if scene.course is not None:
        poses = [scene.course.pose(time, sensor) @ sensor.mounting for time in times]
        for kind in (FOLDERS.lidar, FOLDERS.scans):
            _write_poses(folder / kind, poses)


def _write_mounting(folder: Path, radar: Radar, sensor: Sensor) -> Floats:
    """Writes where the radar is, as seen from the LiDAR: right above or below it."""
    pose = dict.fromkeys(POSE, 0.0) | {"z": radar.mounting_height - sensor.mounting_height}
    mounting, written = motion_of_pose(**pose), dict[str, Any](pose)
    if any(sensor.tilt):
        mounting = sensor.mounting.T @ mounting
        written = {"matrix": mounting.tolist()}
    write_text(folder / "extrinsics.yaml", yaml.safe_dump(written, sort_keys=False))
    return mounting


def _record_radar(
    folder: Path, scene: SimulatedScene, radar: Radar, scan_times: Floats, generator: Generator
) -> list[Scan]:
    """Writes what the radar detects while scans are taken; returns the frame nearest to each."""
    period = 1 / radar.frame_rate
    # The two sensors are not synchronised: the radar's first frame comes anywhere in its period.
    times = np.arange(generator.uniform(0, period), scan_times[-1] + period, period)
    mean = mean_echoes(scene.track, scene.rain, radar)
    frames = [_with_intensity(detect(mean, radar, generator), radar) for _ in times]
    for stem, frame in zip(_stems(len(times)), frames, strict=True):
        write_scan(folder / "radar_pcd" / f"{stem}.bin", replace(frame, fields={}))
        _write_table(folder / "ext_radar" / f"{stem}.csv", _extended(frame))
    for kind in ("radar_pcd", "ext_radar"):
        _write_times(folder / kind, times)
    return [frames[row] for row in nearest_in_time(scan_times, times, within=period)]


def _with_intensity(frame: Scan, radar: Radar) -> Scan:
    """A radar frame with the strength of its echoes over the noise, dB, as their intensity."""
    weakening = 40 * np.log10(frame.range / radar.reach)
    return replace(frame, intensity=to_float32(frame.fields["rcs"] - weakening))


def _extended(frame: Scan) -> dict[str, Floats]:
    """The columns of REHEARSE-3D's extended radar, whose names and units are not published.

    Confidence is the probability that noise alone would have been weaker than the echo.
    """
    assert frame.intensity is not None
    intensity = frame.intensity.astype(np.float64)
    return {
        **dict(zip("xyz", frame.xyz.T, strict=True)),
        "intensity": intensity,
        "cross_section": frame.fields["rcs"],
        "velocity": frame.fields["doppler"],
        "confidence": -np.expm1(-(10 ** (intensity / 10))),
    }


def _stems(count: int) -> list[str]:
    return [f"{number:06d}" for number in range(count)]


def _write_times(folder: Path, times: Floats) -> None:
    rows = [f"{stem},{time:.6f}" for stem, time in zip(_stems(len(times)), times, strict=True)]
    write_text(folder / METADATA, "\n".join([",".join(FRAME_COLUMNS), *rows]) + "\n")


def _write_poses(folder: Path, poses: Sequence[Floats]) -> None:
    """Writes poses in KITTI's form, as seen from the first of them."""
    to_first = np.linalg.inv(poses[0])
    rows = [(to_first @ pose)[:3].ravel() for pose in poses]
    with replacing(folder / POSES) as temporary:
        np.savetxt(temporary, np.round(rows, 9) + 0.0, "%.9f")  # 0.0 takes the sign from -0


def _write_table(path: Path, columns: Mapping[str, ArrayLike]) -> None:
    """Writes columns of one or more numbers each as CSV with their names at the top."""
    table = np.column_stack(list(columns.values()))
    with replacing(path) as temporary:
        np.savetxt(temporary, table, "%.6g", ",", header=",".join(columns), comments="")
