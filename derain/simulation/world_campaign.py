"""A data set of single scans, each drawn from a world, and the writer of one."""

import json
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from derain.cards.card import load_card
from derain.files import write_scan
from derain.files.atomic import replacing
from derain.files.labels import write_labels
from derain.simulation.campaign import SplitSequences
from derain.simulation.classes import unpacked
from derain.simulation.world import World, draw_scan, load_world

# What the folders of a sequence are called.
FOLDERS = load_card("simulated").layout

# Of each sequence.
STEM = "000000"
DRAWN_WORLDS = "drawn.yaml"


@dataclass(frozen=True)
class WorldCampaign(SplitSequences):
    """A data set in which every sequence is one scan, of another place, sensor and weather.

    Attributes:
        train: Scans to train on, at least one.
        validation: Scans to choose a model with.
        test: Scans to judge it on.
        seed: Seed of everything drawn.
        world: What they are drawn from, or the name of a packaged file of it, or of one's own.

    Raises:
        InputError: Too few or too many scans, or a negative seed.
    """

    train: int = 1000
    validation: int = 100
    test: int = 0
    seed: int = 0
    world: World | str = field(default_factory=World)
    DIGITS = 5

    def __post_init__(self) -> None:
        self._check_counts()

    def resolved(self) -> "WorldCampaign":
        """The same with its world read.

        Raises:
            InputError: A file that is missing or damaged.
        """
        world = load_world(self.world) if isinstance(self.world, str) else self.world
        return replace(self, world=world)

    @property
    def description(self) -> dict[str, Any]:
        """Everything that the files depend on, as reading it back from JSON gives it."""
        return self._described(worlds=asdict(self), split=self.split)

    def write(self, folder: Path, name: str) -> None:
        """Simulates a sequence: one scan, its labels, and what it was drawn as.

        Args:
            folder: Folder to write.
            name: Name of the sequence.

        Raises:
            InputError: A file cannot be written, or Open3D cannot be imported.
        """
        assert isinstance(self.world, World)  # after resolved()
        seed = np.random.SeedSequence(self.seed, spawn_key=(int(name),))
        drawn = draw_scan(self.world, np.random.default_rng(seed))
        assert drawn.scan.label is not None
        write_scan(folder / FOLDERS.scans / f"{STEM}.bin", drawn.scan)
        write_labels(folder / FOLDERS.labels / f"{STEM}.label", *unpacked(drawn.scan.label))
        with replacing(folder / DRAWN_WORLDS) as temporary:
            described = json.loads(json.dumps(drawn.description))
            temporary.write_text(yaml.safe_dump(described, sort_keys=False), "utf-8")
