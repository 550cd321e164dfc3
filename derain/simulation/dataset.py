"""Writes a simulated data set in the layout of REHEARSE-3D, together with what it was made from.

manifest.json                                       campaign, split, rain rate of each sequence
sequences/000/lidar_radar_pcd/000000.bin            float32 x, y, z (metres), intensity (0..255)
sequences/000/lidar_radar_labels/000000.label       uint32 TrackClass per point
sequences/000/weather/000000.csv                    rain_rate_mm_h
"""

import json
import shutil
import tempfile
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from derain import __version__
from derain.errors import InputError
from derain.files.binary import write_binary
from derain.files.labels import write_labels
from derain.scan import Scan
from derain.simulation.layout import lay_out_track
from derain.simulation.rain import Rain, rain_on_beams
from derain.simulation.sensor import Sensor

MANIFEST = "manifest.json"
MAKER = "derain.simulation"


@dataclass(frozen=True)
class Campaign:
    """What is simulated: every sequence is another track, and its scans differ in rain and noise.

    Attributes:
        train: Sequences to train on.
        validation: Sequences to choose a model with.
        test: Sequences to judge it on.
        scans: Scans per sequence.
        rain_rates: Rain rates in mm/h that the sequences of each part take in turn; 0 is clean.
        seed: Seed of everything drawn.
        sensor: The sensor.

    Raises:
        InputError: A number of sequences or scans below 1, a negative seed, no rain rate or an
            impossible one.
    """

    train: int = 16
    validation: int = 4
    test: int = 8
    scans: int = 3
    rain_rates: tuple[float, ...] = (0.0, 10.0, 25.0, 50.0)
    seed: int = 0
    sensor: Sensor = field(default_factory=Sensor)

    def __post_init__(self) -> None:
        for name in ("train", "validation", "test", "scans"):
            if getattr(self, name) < 1:
                raise InputError(name, f"{getattr(self, name)} is too few", "Give 1 or more.")
        if self.seed < 0:
            raise InputError("seed", f"{self.seed} is negative", "Give 0 or more.")
        if not self.rain_rates:
            raise InputError("rain rate", "none is given", "Give one or more, in mm/h.")
        for rate in self.rain_rates:
            Rain(rate)

    @property
    def split(self) -> dict[str, list[str]]:
        """Names of the sequences of each part."""
        names = [f"{number:03d}" for number in range(self.train + self.validation + self.test)]
        return {
            "train": names[: self.train],
            "validation": names[self.train : -self.test],
            "test": names[-self.test :],
        }

    @property
    def rain_rate(self) -> dict[str, float]:
        """Rain rate of each sequence, in mm/h, by name in ascending order."""
        return {
            name: float(self.rain_rates[place % len(self.rain_rates)])
            for names in self.split.values()
            for place, name in enumerate(names)
        }

    @property
    def manifest(self) -> dict[str, Any]:
        """All that the files depend on, as JSON gives it back."""
        content = {
            "made_by": MAKER,
            "version": __version__,
            "campaign": asdict(self),
            "split": self.split,
            "rain_rate_mm_h": self.rain_rate,
        }
        return dict(json.loads(json.dumps(content)))


def read_manifest(root: Path) -> dict[str, Any]:
    """The manifest of a simulated data set, as Campaign.manifest; empty where there is none."""
    try:
        content = json.loads((root / MANIFEST).read_text("utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) and content.get("made_by") == MAKER else {}


def ensure_track(root: Path, campaign: Campaign) -> None:
    """Simulates a data set unless the folder already holds this very one.

    Args:
        root: Folder of the data set.
        campaign: What is to be in it.

    Raises:
        InputError: As :func:`simulate_track`.
    """
    if read_manifest(root) != campaign.manifest:
        simulate_track(root, campaign)


def simulate_track(root: Path, campaign: Campaign) -> None:
    """Simulates a data set; the folder appears when it is complete.

    Args:
        root: Folder to write. A simulated data set that is there is replaced.
        campaign: What to simulate.

    Raises:
        InputError: The folder holds something else or cannot be written, or Open3D cannot be
            imported.
    """
    root = root.resolve()
    try:
        _refuse_foreign(root)
        root.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".derain-", dir=root.parent) as temporary:
            built = Path(temporary) / root.name
            _write_sequences(built, campaign)
            (built / MANIFEST).write_text(json.dumps(campaign.manifest, indent=2) + "\n", "utf-8")
            if root.exists():
                shutil.rmtree(root)
            built.rename(root)
    except OSError as error:
        raise InputError(
            root,
            f"cannot be written ({error.strerror or error})",
            "Choose a folder that is writable and has room.",
        ) from error


def _refuse_foreign(root: Path) -> None:
    if not root.exists() or read_manifest(root):
        return
    if not root.is_dir() or any(root.iterdir()):
        raise InputError(
            root, "holds something other than a simulated data set", "Name a new or empty folder."
        )


def _write_sequences(root: Path, campaign: Campaign) -> None:
    total = len(campaign.rain_rate) * campaign.scans
    with tqdm(total=total, desc="simulating", unit="scan", disable=None) as progress:
        for number, (name, rate) in enumerate(campaign.rain_rate.items()):
            chance = np.random.SeedSequence(campaign.seed, spawn_key=(number,))
            layout, *weather = map(np.random.default_rng, chance.spawn(1 + campaign.scans))
            clear = lay_out_track(layout).cast(campaign.sensor)
            for scan, generator in enumerate(weather):
                detected = rain_on_beams(clear, Rain(rate), campaign.sensor, generator)
                measured = campaign.sensor.measure(detected, generator)
                _write_scan(root / "sequences" / name, f"{scan:06d}", measured, rate)
                progress.update()


def _write_scan(sequence: Path, stem: str, scan: Scan, rain_rate: float) -> None:
    assert scan.label is not None  # a simulated scan is labelled
    write_binary(sequence / "lidar_radar_pcd" / f"{stem}.bin", scan)
    write_labels(sequence / "lidar_radar_labels" / f"{stem}.label", scan.label)
    weather = sequence / "weather" / f"{stem}.csv"
    weather.parent.mkdir(exist_ok=True)
    weather.write_text(f"rain_rate_mm_h\n{rain_rate}\n", "utf-8")
