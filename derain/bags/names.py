"""Paths of bags, of topics in bags, and of clouds in topics.

A bag is named like a folder of its topics, and a topic like a folder of its clouds:
``drive.mcap/points/000012`` is a cloud of the topic ``/points`` of ``drive.mcap``.
"""

import os
from pathlib import Path

from derain.errors import InputError
from derain.files.reading import reading

# Suffixes of files that are bags.
ROS1_SUFFIX, MCAP_SUFFIX, SQLITE_SUFFIX = ".bag", ".mcap", ".db3"
SUFFIXES = (ROS1_SUFFIX, MCAP_SUFFIX, SQLITE_SUFFIX)

# Files of ROS 2 that are compressed as a whole; their folder is the bag.
COMPRESSED_SUFFIXES = (".mcap.zstd", ".db3.zstd")

# Suffix of a bag of ROS 1 that is being recorded.
UNFINISHED_SUFFIX = ".bag.active"

# What SQLite adds to the name of a database for the log of changes that are not in it yet.
LOG_SUFFIXES = ("-wal", "-journal")

# The file that makes a folder a bag of ROS 2, and the word that it contains.
BAG_METADATA, METADATA_WORD = "metadata.yaml", b"rosbag2_bagfile_information"


def bags_at(path: Path) -> list[Path]:
    """The bags at a path.

    Args:
        path: A bag, or a folder with bags and no scans in it.

    Returns:
        The bag; or those that lie directly in the folder, sorted by name; none where it is neither.

    Raises:
        InputError: A part of a bag that cannot be read without the others.
    """
    if is_bag(path):
        return [path]
    if not os.path.isdir(path):
        return []
    with reading(path):
        inside = sorted(path.iterdir())
    return [each for each in inside if not each.name.startswith(".") and is_bag(each)]


def is_bag(path: Path) -> bool:
    """True if something is a bag: a file by its suffix, a folder by what it holds.

    Raises:
        InputError: A file of ROS 2 that is compressed as a whole, or a bag of ROS 1 whose recording
            was not ended.
    """
    if os.path.isfile(path):
        if path.name.lower().endswith(UNFINISHED_SUFFIX):
            raise InputError(
                path,
                "is a bag that is still being recorded, or was cut off",
                "End the recording; or rename a copy to .bag, and repair it by rosbag reindex.",
            )
        if path.name.lower().endswith(COMPRESSED_SUFFIXES):
            raise InputError(path, "is one compressed file of a bag", "Name the bag's folder.")
        return path.suffix.lower() in SUFFIXES
    metadata = path / BAG_METADATA
    if not os.path.isfile(metadata):
        return False
    with reading(metadata), metadata.open("rb") as file:
        return METADATA_WORD in file.read(2**12)


def files_of(bag: Path) -> list[Path]:
    """The files of a bag: itself and its logs, or those in its folder, sorted."""
    return sorted(filter(Path.is_file, bag.iterdir())) if bag.is_dir() else [bag, *logs_of(bag)]


def logs_of(database: Path) -> list[Path]:
    """The logs beside a database, with changes that SQLite has not written into it yet."""
    logs = (database.with_name(database.name + suffix) for suffix in LOG_SUFFIXES)
    return [log for log in logs if log.is_file()]


def split(path: Path) -> tuple[Path, str] | None:
    """Splits a path into a bag and the topic or cloud in it.

    Args:
        path: The path.

    Returns:
        The bag, and ``""``, ``"topic"``, ``"number"`` or ``"topic/number"``; None where no part of
        the path is a bag.
    """
    inner: list[str] = []
    for place in (path, *path.parents):
        if os.path.lexists(place):
            return (place, "/".join(reversed(inner))) if is_bag(place) else None
        inner.append(place.name)
    return None


def in_bag(path: Path, topic: str | None) -> Path:
    """The path of a topic in a bag.

    Args:
        path: The bag, or any other path.
        topic: The topic; None returns the path as it is.

    Raises:
        InputError: A topic, and the path is of no bag.
    """
    if topic is None:
        return path
    if not is_bag(path):
        raise InputError("--topic", f"{path} is not a bag", "Leave it out.")
    return path / topic.strip("/")


def stem(bag: Path) -> str:
    """The name of a bag without the suffix of its storage."""
    path = Path(os.path.abspath(bag))
    return path.stem if path.suffix.lower() in SUFFIXES else path.name


def written_name(bag: Path, is_file: bool) -> str:
    """Name of the copy of a bag: of a folder and of a database a folder, else a file.

    Args:
        bag: Path of the bag.
        is_file: True if it is a file.
    """
    return bag.name if is_file and bag.suffix.lower() != SQLITE_SUFFIX else stem(bag)
