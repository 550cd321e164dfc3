"""Writes a simulated data set in the layout of REHEARSE-3D, with a manifest of its origin.

manifest.json       campaign, split, rain rate of each sequence, SHA-256 of each file
sequences/000/...   see :mod:`derain.simulation.sequence`
.derain/            records of the sequences that are simulated, see :mod:`derain.jobs.job`

A sequence is a unit of a job, and its folder appears when it is complete, so an interrupted run can
resume. Each sequence has a random generator of its own, so interruptions, processes, shards and
machines do not change a byte. If two runs use one folder, the second waits for the first; shards of
one run do not wait for each other.
"""

import hashlib
import os
import shutil
import sys
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from derain.errors import InputError
from derain.files.atomic import lock, remove_abandoned, temporary_folder, writing
from derain.jobs.job import FOLDER, Job, differences
from derain.jobs.running import IsThere, Submits, Task, Value, ValueWork, values
from derain.jobs.shard import Shard
from derain.jobs.unit import Unit
from derain.simulation.campaign import SplitSequences
from derain.simulation.manifest import MANIFEST, parameters_of, read_manifest, write_manifest
from derain.system.open3d_import import import_open3d

SEQUENCES = "sequences"


def simulate_track(
    root: Path,
    campaign: SplitSequences,
    executor: Submits | None = None,
    shard: Shard | None = None,
    *,
    keep: bool = True,
) -> bool:
    """Simulates a data set, or its missing parts.

    Args:
        root: Folder to write: a new or an empty one, or one that holds part of this very data set.
        campaign: The campaign to simulate.
        executor: Simulates the sequences; None does it in this process.
        shard: The shard of the sequences that is simulated; None for all. Whoever does the last
            shard completes the manifest.
        keep: True if the data set is a person's. One that a program made for its own use, without
            it, is replaced where the program simulates another campaign in the folder.

    Returns:
        Whether the data set is complete; False while other shards are to be simulated.

    Raises:
        InputError: The folder holds something else or cannot be written, Open3D cannot be imported,
            or a sequence cannot be simulated. The others are simulated then, and nothing is
            half-written.
    """
    campaign = campaign.resolved()  # reports a wrong file first
    description = {**campaign.description, "keep": keep}
    with _locked(root, shared=shard is not None):
        there = read_manifest(root)
        if not (keep or there.get("keep")) and there and not _describes(there, campaign):
            _remove(root)
            there = {}
        _refuse_others(root, there, campaign)
        if "files" in there and all((root / SEQUENCES / name).is_dir() for name in campaign.names):
            return True
        import_open3d()  # raises where it is missing, before anything is written
        # The manifest comes first: a folder with content but without one is refused.
        if there != description:
            write_manifest(root, description)
        # Absolute, because other processes may work in another folder.
        work = SequenceWork(root.absolute(), campaign)
        options = {"command": "simulate", **parameters_of(description)}
        units = [Unit(id=name, size=1, inputs="") for name in campaign.names]
        job, to_do = Job.begin(work.root, options, units, shard)
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


def _remove(root: Path) -> None:
    """Removes a data set."""
    with writing(root):
        # The manifest goes last. Without it the folder would be taken for somebody else's, should
        # this run be killed in between; the sequences may then be gone already.
        for name in (SEQUENCES, FOLDER):
            if (root / name).exists():
                shutil.rmtree(root / name)
        (root / MANIFEST).unlink()


@contextmanager
def _locked(root: Path, *, shared: bool) -> Iterator[None]:
    """Makes the folder and locks it, so that only one process at a time simulates in it.

    Args:
        root: The folder.
        shared: True if the shards of one run may simulate in it at the same time.
    """
    if root.exists() and not root.is_dir():
        raise InputError(root, "is not a folder", "Name a new or empty folder.")
    with writing(root):
        root.mkdir(parents=True, exist_ok=True)
    with ExitStack() as held:
        with suppress(OSError):  # without locks two runs on one folder do not wait for each other
            folder = os.open(root, os.O_RDONLY)
            held.callback(os.close, folder)
            if not lock(folder, wait=False, shared=shared):
                print(f"derain: waits for another run that simulates in {root}", file=sys.stderr)
                lock(folder, wait=True, shared=shared)
        remove_abandoned(root)
        yield


def _describes(manifest: Mapping[str, Any], campaign: SplitSequences) -> bool:
    return manifest.items() >= campaign.description.items()


def _refuse_others(root: Path, there: Mapping[str, Any], campaign: SplitSequences) -> None:
    if there and not _describes(there, campaign):
        changed = differences(parameters_of(there), parameters_of(campaign.description))
        reason = f"holds a simulated data set of other parameters: {changed}"
        raise InputError(root, reason, "Name another folder, or delete this one.")
    if not there and any(root.iterdir()):
        reason = "holds something other than a simulated data set"
        raise InputError(root, reason, "Name a new or empty folder.")
