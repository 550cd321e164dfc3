"""Which scans a network was trained on, so that it is not measured on them unawares.

Sequences of a published data set are recorded by their names, and all other scans by fingerprints
of their files: everybody's folders may be called the same.
"""

from collections.abc import Iterable, Mapping, Sequence
from hashlib import sha256
from pathlib import Path

from derain.cards.card import DataCard
from derain.files.reading import file_size, reading
from derain.sources.frame import Frame
from derain.sources.spread import evenly_spaced
from derain.spec import Spec

# What a record holds: names of sequences, and fingerprints of scans.
SEQUENCES, SCANS = "sequences", "scans"

# A Spec is a small document: of more scans than these, so many are recorded, evenly spread.
MOST_NAMES = 2000

# Bytes at either end of a file that tell it from others; no two scans begin and end alike.
ENDS = 2**16


def by_name(sequences: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Record of a training on sequences of a published data set, as a Spec holds it."""
    names = tuple(sorted(sequences)[:MOST_NAMES])
    return {SEQUENCES: names} if names else {}


def by_fingerprint(scans: Sequence[Path]) -> dict[str, tuple[str, ...]]:
    """Record of a training on some scans, as a Spec holds it.

    Args:
        scans: Their files.

    Raises:
        InputError: A file that cannot be read.
    """
    prints = tuple(sorted(set(map(fingerprint, evenly_spaced(scans, MOST_NAMES)))))
    return {SCANS: prints} if prints else {}


def fingerprint(scan: Path) -> str:
    """What tells the content of a file from that of others, 16 hexadecimal digits.

    Raises:
        InputError: A file that cannot be read.
    """
    with reading(scan):
        size = file_size(scan)
        with scan.open("rb") as file:
            ends = file.read(ENDS)
            file.seek(max(size - ENDS, 0))
            ends += file.read(ENDS)
    return sha256(size.to_bytes(8, "little") + ends).hexdigest()[:16]


def overlap(title: str, spec: Spec, card: DataCard, scans: Sequence[Frame]) -> str | None:
    """What is to be said of a model that was trained on some of the scans it is measured on.

    Args:
        title: What the model is called.
        spec: Its Spec.
        card: Data card of the scans.
        scans: The scans.

    Returns:
        One sentence; None where it was trained on none of the scans, or nothing is known of it.

    Raises:
        InputError: A scan that cannot be read.
    """
    known = [scan for scan in scans if _trained_on(scan, spec.training, spec.data == card.name)]
    if not known:
        return None
    share = f"{len(known):,} of these {len(scans):,} scans, such as {known[0].name}"
    return f"{title} was trained on {share}: its scores say little of others"


def _trained_on(scan: Frame, training: Mapping[str, tuple[str, ...]], same_data: bool) -> bool:
    if same_data and scan.sequence in training.get(SEQUENCES, ()):
        return True
    return bool(training.get(SCANS)) and scan.fingerprint() in training[SCANS]
