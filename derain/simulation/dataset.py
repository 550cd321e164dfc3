"""Writes a simulated data set in the layout of REHEARSE-3D, with a manifest of its origin.

manifest.json       campaign, split, rain rate of each sequence, SHA-256 of each file
sequences/000/...   see :mod:`derain.simulation.sequence`
.derain/            records of the sequences that are simulated, see :mod:`derain.jobs.job`

A sequence is a unit of a job, and its folder appears when it is complete, so an interrupted run can
resume. Each sequence has a random generator of its own, so interruptions, processes, shards and
machines do not change a byte. Two runs of one campaign in one folder write the same bytes; of two
campaigns, the second is refused.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from derain.errors import InputError
from derain.files.atomic import temporary_folder, writing
from derain.jobs.job import FOLDER, Job, differences
from derain.jobs.running import IsThere, Submits, Task, Value, ValueWork, values
from derain.jobs.shard import Shard
from derain.jobs.unit import Unit
from derain.simulation.campaign import SplitSequences
from derain.simulation.manifest import parameters_of, read_manifest, write_manifest
from derain.system.open3d_import import import_open3d

SEQUENCES = "sequences"


def simulate_track(
    root: Path,
    campaign: SplitSequences,
    executor: Submits | None = None,
    shard: Shard | None = None,
) -> bool:
    """Simulates a data set, or its missing parts.

    Args:
        root: Folder to write: a new or an empty one, or one that holds part of this very data set.
        campaign: The campaign to simulate.
        executor: Simulates the sequences; None does it in this process.
        shard: The shard of the sequences that is simulated; None for all. Whoever does the last
            shard completes the manifest.

    Returns:
        Whether the data set is complete; False while other shards are to be simulated.

    Raises:
        InputError: The folder holds something else or cannot be written, Open3D cannot be imported,
            or a sequence cannot be simulated. The others are simulated then, and nothing is
            half-written.
    """
    campaign = campaign.resolved()  # reports a wrong file first
    description = campaign.description
    there = _begun(root, description)
    if "files" in there and all((root / SEQUENCES / name).is_dir() for name in campaign.names):
        return True
    import_open3d()  # raises where it is missing, before anything is written
    # Absolute, because other processes may work in another folder.
    work = SequenceWork(root.absolute(), campaign)
    options = {"command": "simulate", **parameters_of(description)}
    units = [Unit(id=name, size=1, inputs="") for name in campaign.names]
    # The job comes before the manifest: of two campaigns that begin at once, it refuses the second.
    job, to_do = Job.begin(work.root, options, units, shard)
    if there != description:
        write_manifest(root, description)
    outcomes = values(Task(job, work), units, to_do, executor, "simulating", "sequence")
    if outcomes is None:
        return False
    files: dict[str, str] = {}
    for checksums_of_sequence in outcomes:
        files |= checksums_of_sequence
    write_manifest(root, {**description, "files": files})
    return True


@dataclass(frozen=True)
class SequenceWork(ValueWork[Unit]):
    """Simulates sequences, whose names are the ids of the units.

    Attributes:
        root: Folder of the data set.
        campaign: The campaign to simulate.
    """

    root: Path
    campaign: SplitSequences

    def check(self) -> None:
        """Refuses a process that cannot import Open3D."""
        import_open3d()

    def value(self, unit: Unit) -> dict[str, str]:
        """Simulates a sequence, unless it is there; returns the checksums of its files."""
        folder = self.root / SEQUENCES / unit.id
        if not folder.exists():
            with writing(self.root), temporary_folder(folder.parent) as temporary:
                self.campaign.write(temporary / unit.id, unit.id)
                try:
                    (temporary / unit.id).rename(folder)
                except OSError:
                    if not folder.is_dir():  # else another process was quicker, with the same bytes
                        raise
        return _checksums(folder, self.root)

    def look(self) -> IsThere[Unit, Value]:
        """True if a sequence is there."""
        return lambda unit, values: (self.root / SEQUENCES / unit.id).is_dir()


def _checksums(folder: Path, root: Path) -> dict[str, str]:
    """SHA-256 of every file below a folder, by its path from the root, in ascending order."""
    return {
        file.relative_to(root).as_posix(): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(folder.rglob("*"))
        if file.is_file()
    }


def _begun(root: Path, description: Mapping[str, Any]) -> dict[str, Any]:
    """The manifest of a folder that holds part of this data set; empty for a new or empty one.

    Raises:
        InputError: The folder holds something else, is a file, or cannot be made.
    """
    with writing(root):
        root.mkdir(parents=True, exist_ok=True)
    # Looked for before the manifest is read, which another run may be about to write.
    others = any(not file.name.startswith(FOLDER) for file in root.iterdir())
    there = read_manifest(root)
    if there and not there.items() >= description.items():
        changed = differences(parameters_of(there), parameters_of(description))
        reason = f"holds a simulated data set of other parameters: {changed}"
        raise InputError(root, reason, "Name another folder, or delete this one.")
    if others and not there:
        reason = "holds something other than a simulated data set"
        raise InputError(root, reason, "Name a new or empty folder.")
    return there
