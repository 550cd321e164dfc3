"""Which scans a network was trained on, by name, so that it is not measured on them unawares."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from derain.cards import DataCard
from derain.data_layout import sequence_of
from derain.files.names import scan_stem
from derain.spec import Spec

# A Spec is a small document. Of more scans than these the sequences are recorded whole, and what
# lies in more sequences than these is recorded in part.
MOST_NAMES = 2000


def whole(sequences: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Record of a training on whole sequences, as a Spec holds it."""
    return dict.fromkeys(sorted(sequences)[:MOST_NAMES], ())


def recorded(scans: Sequence[Path]) -> dict[str, tuple[str, ...]]:
    """Record of a training on some scans, as a Spec holds it: their stems by their sequence.

    Args:
        scans: Their files, each in ``<sequence>/<folder of scans>/``.
    """
    stems: dict[str, set[str]] = {}
    for scan in scans:
        stems.setdefault(sequence_of(scan), set()).add(scan_stem(scan))
    if sum(map(len, stems.values())) > MOST_NAMES:
        return whole(stems)
    return {name: tuple(sorted(of_sequence)) for name, of_sequence in sorted(stems.items())}


def overlap(title: str, spec: Spec, card: DataCard, scans: Sequence[Path]) -> str | None:
    """What is to be said of a model that was trained on some of the scans it is measured on.

    Args:
        title: What the model is called.
        spec: Its Spec.
        card: Data card of the scans.
        scans: The scans.

    Returns:
        One sentence; None where it was trained on other data, or on none of the scans, or where
        nothing is known of it.
    """
    if spec.data != card.name:
        return None
    known = [scan for scan in scans if _trained_on(scan, spec.training)]
    if not known:
        return None
    return (
        f"{title} was trained on {len(known):,} of these {len(scans):,} scans, such as {known[0]}: "
        "its scores say little of others"
    )


def _trained_on(scan: Path, training: Mapping[str, tuple[str, ...]]) -> bool:
    stems = training.get(sequence_of(scan))
    return stems is not None and (not stems or scan_stem(scan) in stems)
