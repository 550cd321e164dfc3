"""Parts of the name of a scan's file: the suffix of its format, and the stem of its labels."""

from pathlib import Path

COMPRESSED = ".gz"


def scan_stem(scan: Path) -> str:
    """The name of a scan without the suffix of its format, compressed or not.

    Both scan.bin and scan.bin.gz are ``scan``: it names the results of a scan.
    """
    return Path(_uncompressed(scan.name)).stem


def scan_suffix(scan: Path) -> str:
    """The suffix of a scan's format in lower case, such as .bin of SCAN.BIN.gz; may be empty."""
    return Path(_uncompressed(scan.name)).suffix.lower()


def beside(scan: Path, suffix: str) -> Path:
    """The file in a scan's folder that has its stem and another suffix."""
    return scan.with_name(scan_stem(scan) + suffix)


def is_compressed(scan: Path) -> bool:
    """True if the file is compressed as a whole."""
    return scan.suffix.lower() == COMPRESSED


def _uncompressed(name: str) -> str:
    return name[: -len(COMPRESSED)] if name.lower().endswith(COMPRESSED) else name
