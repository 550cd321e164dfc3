"""The folder that the snippets of a page are run in: what they take for granted."""

import shutil
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from recorded_scenes import write_wads

from benchmarks.recorded_bags import Ros, drive, table_of, write_bag
from derain.cards.card import load_card
from derain.cli.main import main
from derain.files.labels import read_labels, write_labels
from derain.scan import class_ids

if TYPE_CHECKING:
    from derain.models.outdet import OutDet

REPOSITORY = Path(__file__).resolve().parents[2]
KEPT = REPOSITORY / "tests/export/kept"

# The sensor of the drive, of half its columns: scans are judged in half the time.
SENSOR = REPOSITORY / "derain/simulation/sensors/spinning_16.yaml"

# Ids of rain and of the rest: of the simulation, of WADS, and of a card that a page makes.
SIMULATED_RAIN, FALLING_SNOW, ROAD = 3, 110, 40

# Metres beyond which the fog of the page of troubles returns nothing.
FOG_ENDS = 18

# Half a second, 10,000 points a scan.
DRIVE = "--layout street --speed 6 --rain 25 --sequences 1 --scans 5"


def write_drive(folder: Path) -> None:
    """Simulates a short drive through a street in the rain, and records it in a bag as well."""
    sensor = folder.with_suffix(".yaml")
    sensor.write_text(SENSOR.read_text("utf-8").replace("columns: 1800", "columns: 900"), "utf-8")
    simulate = ["simulate", "--out", folder, *DRIVE.split(), "--sensor", sensor, "--workers", 1]
    assert main([str(word) for word in simulate]) == 0
    clouds = [np.fromfile(scan, np.float32).reshape(-1, 4) for scan in _scans(folder)]
    columns = ("x", "y", "z", "intensity")
    tables = [table_of(dict(zip(columns, cloud.T, strict=True))) for cloud in clouds]
    write_bag(folder / "bag", "mcap", drive(Ros("mcap"), tables))


def prepare(folder: Path, simulated: Path) -> None:
    """Puts into a folder what pages name: scans, a drive, a bag, labels, a model, data sets.

    Args:
        folder: The page's own.
        simulated: What :func:`write_drive` wrote.
    """
    sequence = simulated / "sequences/000"
    scans = _scans(simulated)
    for name in ("drive", "scans", "labelled", "my_data/sequences/00/lidar"):
        (folder / name).mkdir(parents=True)
    (folder / "my_data/sequences/00/classes").mkdir()
    for number, scan in enumerate(scans):
        size = scan.stat().st_size // 16
        label = class_ids(read_labels(sequence / f"lidar_radar_labels/{scan.stem}.label", size))
        rain = label == SIMULATED_RAIN
        snow = np.where(rain, FALLING_SNOW, ROAD)
        _put(scan, folder / "drive", snow)
        _put(scan, folder / "labelled", rain.astype(np.int64))
        if number < 3:
            _put(scan, folder / "scans", snow)
    shutil.copy(scans[0], folder / "scan.bin")
    shutil.copy(scans[0], folder / "my_data/sequences/00/lidar")
    shutil.copy(
        folder / "labelled/000000.label", folder / "my_data/sequences/00/classes/000000.label"
    )
    points = np.fromfile(scans[0], np.float32).reshape(-1, 4)
    # Of an odd number of rows, five columns are no whole rows of four.
    odd = points[: len(points) // 2 * 2 - 1]
    np.hstack([odd, np.zeros((len(odd), 1), np.float32)]).tofile(folder / "rings.bin")
    shutil.copy(next(simulated.glob("bag/*.mcap")), folder / "drive.mcap")
    shutil.copy(KEPT / "outdet.onnx", folder / "model.onnx")
    shutil.copy(KEPT / "outdet.ckpt", folder / "model.ckpt")
    write_wads(folder / "WADS", *chain(*load_card("wads").split.values()))
    _put_troubles(folder)


def put_weights(folder: Path, outdet: "OutDet") -> None:
    """Puts weights into a folder as the authors of 3D-OutDet publish theirs."""
    import torch

    from derain.models.outdet import PUBLISHED_KEYS

    tensors = outdet.network.state_dict()
    published = {name: tensors[ours] for ours, name in PUBLISHED_KEYS.items()}
    for name in ("saved_models/bin_desnow_wads/outdet.pt", "rehearse3d_outdet.pt"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        torch.save(published, folder / name)


def _scans(simulated: Path) -> list[Path]:
    return sorted((simulated / "sequences/000/lidar_radar_pcd").glob("*.bin"))


def _put(scan: Path, folder: Path, label: "np.ndarray[tuple[int], np.dtype[np.int64]]") -> None:
    """Copies a scan and writes its labels beside it."""
    shutil.copy(scan, folder)
    write_labels(folder / f"{scan.stem}.label", label)


def _put_troubles(folder: Path) -> None:
    """What may go wrong with the first of the scans: fog, units, maps, other files and folders."""
    cloud = np.fromfile(folder / "scans/000000.bin", np.float32).reshape(-1, 4)
    rain = class_ids(read_labels(folder / "scans/000000.label", len(cloud))) == FALLING_SNOW
    dry = cloud[~rain]
    dry.tofile(folder / "dry.bin")
    dry[np.linalg.norm(dry[:, :3], axis=1) < FOG_ENDS].tofile(folder / "fog.bin")
    (cloud * np.float32([1000, 1000, 1000, 1])).tofile(folder / "millimetres.bin")
    # Where the vehicle stands five times, five metres apart.
    along = [cloud + np.float32([5 * place, 0, 0, 0]) for place in range(5)]
    np.concatenate(along).tofile(folder / "map.bin")
    for name in ("morning", "recording/velodyne", "recording/truth"):
        (folder / name).mkdir(parents=True)
    for name in ("morning", "recording/velodyne"):
        shutil.copy(folder / "scans/000000.bin", folder / name)
    shutil.copy(folder / "scans/000000.label", folder / "recording/truth")
    (folder / "morning/positions.csv").write_text("x,y,z\n0,0,0\n")
