"""What commands leave in folders."""

from pathlib import Path

from derain.jobs.job import FOLDER


def contents(folder: Path) -> dict[str, bytes]:
    """Every file in a folder but derain's records, by its path in there."""
    files = [path for path in folder.rglob("*") if path.is_file() and FOLDER not in path.parts]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in sorted(files)}
