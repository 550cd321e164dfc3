"""A training in stages on simulated worlds, each of which starts from the one before."""

import shlex
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from benchmarks.installed import DERAIN
from derain.errors import InputError
from derain.simulation.world import WorldCampaign

# Written into the folder of a training once it has ended: the command that it was.
RECORD = "command.txt"


@dataclass(frozen=True)
class Stage:
    """A part of the training.

    Attributes:
        world: Name of the packaged world.
        root: Folder of its scans, which are made where they are missing.
        train: Scans to train on.
        validation: Scans that are held out.
        epochs: How often each is trained on.
        rate: Highest rate of learning.
        drawn: Seed of the worlds.
        configuration: The packaged configuration that trains it.
    """

    world: str
    root: Path
    train: int
    validation: int
    epochs: int
    rate: float
    drawn: int = 0
    configuration: str = "relative_outdet_worlds.yaml"

    @property
    def campaign(self) -> WorldCampaign:
        """How its scans are simulated."""
        return WorldCampaign(self.train, self.validation, seed=self.drawn, world=self.world)

    def command(self, folder: Path, seed: int, start: Path | None = None) -> list[str]:
        """Options of derain that train it.

        Args:
            folder: Folder of the training's checkpoints and log.
            seed: Seed of the training.
            start: Checkpoint whose weights it begins with; None draws them at random.
        """
        started = [] if start is None else ["--start", str(start)]
        return [
            *("fit", "--config", self.configuration, "--seed_everything", str(seed)),
            *("--data.root", str(self.root), "--data.campaign.world", self.world),
            *("--data.campaign.seed", str(self.drawn)),
            *("--data.campaign.train", str(self.train)),
            *("--data.campaign.validation", str(self.validation)),
            *("--trainer.max_epochs", str(self.epochs)),
            *("--model.learning_rate", str(self.rate), *started),
            *("--trainer.logger.init_args.save_dir", str(folder)),
        ]


def trained(stage: Stage, folder: Path, seed: int, start: Path | None = None) -> Path:
    """The last checkpoint of a stage, which is not trained again where that has been done.

    Args:
        stage: What is trained.
        folder: Folder of the training. One that did not end is removed, and begun anew.
        seed: Seed of the training.
        start: Checkpoint whose weights it begins with; None draws them at random.

    Raises:
        InputError: The folder has a training of another command, or derain failed.
    """
    command = stage.command(folder, seed, start)
    told, record = shlex.join(command), folder / RECORD
    if record.exists():
        if record.read_text("utf-8") == told:
            return _last(folder)
        remedy = "Give another --out, or remove it."
        raise InputError(folder, f"has the training of another command, which {RECORD} is", remedy)
    if folder.exists():
        shutil.rmtree(folder)
    print(f"derain {told}", flush=True)
    if subprocess.run([DERAIN, *command], check=False).returncode:
        raise InputError(folder, "derain fit failed", "See above.")
    record.write_text(told, "utf-8")  # last: a training that is stopped before is begun anew
    return _last(folder)


def _last(folder: Path) -> Path:
    """The last checkpoint of the one training in a folder."""
    (checkpoint,) = folder.glob("*/version_0/checkpoints/last.ckpt")
    return checkpoint
