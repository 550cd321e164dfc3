"""Where poses of recordings are written, and that nothing of the recordings is lost by it."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from derain.cards.layout import folder_above
from derain.cli.outputs import refuse_unwritable
from derain.errors import InputError
from derain.files import RECORDS
from derain.files.reading import is_file
from derain.sources.frame import Frame
from derain.sources.records import POSES
from derain.sources.trajectory import CALIBRATION
from derain.system.notices import warn


def files_of(recordings: Sequence[Sequence[Frame]], out: Path, replace: bool) -> list[Path]:
    """The file of each recording's poses, once it is known that it can be written.

    Args:
        recordings: The recordings.
        out: The file of the only one; of several, a folder with ``<sequence>.txt`` for each.
        replace: Whether poses that came with the scans may be replaced.

    Raises:
        InputError: A file that cannot be written, that came with the scans, or that two recordings
            would share.
    """
    files = [out]
    if len(recordings) > 1:
        files = [out / f"{recording[0].sequence}.txt" for recording in recordings]
    for place, (file, recording) in enumerate(zip(files, recordings, strict=True)):
        if file in files[:place]:
            raise InputError(
                recording[0].name,
                f"another recording is called {recording[0].sequence} too, and the poses of both "
                f"would be {file}",
                "Take them in two runs, each to its --out.",
            )
        _refuse_to_overwrite(file, recording, replace)
        refuse_unwritable(file)
    return files


def tell_whose_poses(files: Sequence[Path], recordings: Sequence[Sequence[Frame]]) -> None:
    """Warns of poses that would be taken for a camera's if they were put beside the scans.

    Args:
        files: The file of each recording's poses, of KITTI's form.
        recordings: The recordings.
    """
    for file, recording in zip(files, recordings, strict=True):
        for folder in _folders(recording):
            here = folder / CALIBRATION
            if is_file(here) and not is_file(file.with_name(CALIBRATION)):
                warn(
                    f"{file}: holds poses of the LiDAR; beside {here} they would be read as those "
                    f"of its camera: to use them there, write them there, with --out {folder}/..."
                )


def _refuse_to_overwrite(file: Path, recording: Sequence[Frame], replace: bool) -> None:
    target = os.path.realpath(file)
    for frame in recording:
        for own in filter(None, (Path(frame.name), frame.label_path)):
            if os.path.realpath(own) == target:
                raise InputError(file, "is one of the scans or their labels", "Name another file.")
    for folder in _folders(recording):
        for record in RECORDS:
            if os.path.realpath(folder / record) != target or not is_file(file):
                continue
            if record != POSES:
                raise InputError(file, "came with the scans", "Name another file.")
            if not replace:
                raise InputError(
                    file,
                    "holds poses that came with the scans",
                    "Name another file, or replace them with --replace.",
                )


def _folders(recording: Sequence[Frame]) -> Iterator[Path]:
    """The folders in which records of a recording may lie."""
    folder = Path(recording[0].name).parent
    yield folder
    yield folder_above(folder)
