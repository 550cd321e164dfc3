"""Writes a simulated data set in the layout of REHEARSE-3D, with a manifest of its origin.

manifest.json       campaign, split, rain rate of each sequence, SHA-256 of each file
sequences/000/...   see :mod:`derain.simulation.sequence`

A sequence's folder appears when it is complete, so that an interrupted run can be taken up again.
Each sequence is drawn with a random generator of its own, so that neither an interruption nor the
number of workers changes a byte. Of two runs on one folder the second waits for the first.
"""

import os
import shutil
import sys
from collections.abc import Generator, Iterator, Mapping
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, closing, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

from tqdm import tqdm

from derain.errors import InputError
from derain.files.atomic import lock, remove_abandoned
from derain.simulation.campaign import SplitSequences
from derain.simulation.manifest import MANIFEST, checksums, read_manifest, write_manifest
from derain.system.open3d_import import import_open3d
from derain.system.workers import worker_pool

SEQUENCES = "sequences"


def ensure_track(root: Path, campaign: SplitSequences, workers: int = 1) -> None:
    """Simulates a data set for a program's own use, unless the folder already holds this very one.

    If the folder holds a data set that this function made of another campaign, it is replaced. One
    that :func:`simulate_track` made is never replaced, because a person asked for it.

    Args:
        root: Folder of the data set.
        campaign: What is to be in it.
        workers: Processes that share the work.

    Raises:
        InputError: As :func:`simulate_track`.
    """
    _simulate(root, campaign, workers, keep=False)


def simulate_track(root: Path, campaign: SplitSequences, workers: int = 1) -> None:
    """Simulates a data set, or what is missing of it.

    Args:
        root: Folder to write: a new or an empty one, or one that holds part of this very data set.
        campaign: What to simulate.
        workers: Processes that share the work.

    Raises:
        InputError: The folder holds something else or cannot be written, or Open3D cannot be
            imported. What was complete by then stays, and nothing half-written.
    """
    _simulate(root, campaign, workers, keep=True)


def _simulate(root: Path, campaign: SplitSequences, workers: int, *, keep: bool) -> None:
    """Simulates the sequences that are missing.

    Args:
        root: Folder of the data set.
        campaign: What to simulate.
        workers: Processes that share the work.
        keep: Whether the data set is a person's; otherwise :func:`ensure_track` may replace it.
    """
    campaign = campaign.resolved()  # reports a wrong file first
    description = {**campaign.description, "keep": keep}
    with _alone(root):
        if not keep:
            _remove_another(root, campaign)
        there = read_manifest(root)
        _refuse_others(root, there, campaign)
        if "files" in there and all((root / SEQUENCES / name).is_dir() for name in campaign.names):
            return
        import_open3d()  # raises where it is missing, before anything is written
        files: dict[str, str] = {}
        with _writing(root):
            # The manifest comes first: a folder with content but without one is refused.
            write_manifest(root, description)
            (root / SEQUENCES).mkdir(exist_ok=True)
            with closing(_complete_sequences(root, campaign, workers)) as complete:
                for written in complete:
                    files |= written
            write_manifest(root, {**description, "files": files})


def _remove_another(root: Path, campaign: SplitSequences) -> None:
    """Removes the data set of another campaign, unless it is a person's."""
    there = read_manifest(root)
    if there and not there.get("keep") and not _describes(there, campaign):
        with _writing(root):
            # The manifest goes last. Without it the folder would be taken for somebody else's,
            # should this run be killed in between; the sequences may then be gone already.
            if (root / SEQUENCES).exists():
                shutil.rmtree(root / SEQUENCES)
            (root / MANIFEST).unlink()


@contextmanager
def _alone(root: Path) -> Iterator[None]:
    """Makes the folder and locks it, so that only one process at a time simulates in it."""
    if root.exists() and not root.is_dir():
        raise InputError(root, "is not a folder", "Name a new or empty folder.")
    with _writing(root):
        root.mkdir(parents=True, exist_ok=True)
    with ExitStack() as held:
        with suppress(OSError):  # without locks two runs on one folder do not wait for each other
            folder = os.open(root, os.O_RDONLY)
            held.callback(os.close, folder)
            if not lock(folder, wait=False):
                print(f"derain: waits for another run that simulates in {root}", file=sys.stderr)
                lock(folder, wait=True)
        remove_abandoned(root)
        yield


@contextmanager
def _writing(root: Path) -> Iterator[None]:
    """Turns the system's refusal to write into an error that a user can act on."""
    try:
        yield
    except OSError as error:
        reason = f"cannot be written ({error.strerror or error})"
        raise InputError(root, reason, "Choose a folder that is writable and has room.") from error


def _describes(manifest: Mapping[str, Any], campaign: SplitSequences) -> bool:
    return manifest.items() >= campaign.description.items()


def _refuse_others(root: Path, there: Mapping[str, Any], campaign: SplitSequences) -> None:
    if there and not _describes(there, campaign):
        reason = "holds a simulated data set of other parameters or of another version of derain"
        raise InputError(root, reason, "Name another folder, or delete this one.")
    if not there and any(root.iterdir()):
        reason = "holds something other than a simulated data set"
        raise InputError(root, reason, "Name a new or empty folder.")


def _complete_sequences(
    root: Path, campaign: SplitSequences, workers: int
) -> Generator[dict[str, str], None, None]:
    """Checksums of every sequence, made where it is missing, in ascending order."""
    complete = partial(_complete_sequence, root, campaign)
    count = len(campaign.names)
    progress = partial(tqdm, total=count, desc="simulating", unit="sequence", disable=None)
    if workers == 1:
        yield from progress(map(complete, campaign.names))
        return
    try:
        with worker_pool(workers) as pool:
            yield from progress(pool.map(complete, campaign.names))
    except BrokenProcessPool as error:
        reason = "a worker was killed, perhaps for want of memory"
        raise InputError(root, reason, "Try again with fewer workers.") from error
    finally:
        for name in campaign.names:  # a worker that was killed leaves what it had begun
            shutil.rmtree(_unfinished(root, name), ignore_errors=True)


def _unfinished(root: Path, name: str) -> Path:
    return root / SEQUENCES / f".{name}"


def _complete_sequence(root: Path, campaign: SplitSequences, name: str) -> dict[str, str]:
    folder, unfinished = root / SEQUENCES / name, _unfinished(root, name)
    if not folder.exists():
        shutil.rmtree(unfinished, ignore_errors=True)  # left behind by a run that was killed
        try:
            campaign.write(unfinished, name)
            unfinished.rename(folder)
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)
    return checksums(folder, root)
