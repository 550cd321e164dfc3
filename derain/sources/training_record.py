"""The record of the scans that a network was trained on, for a warning if it is measured on them.

Sequences of a published data set are recorded by their names, and all other scans by fingerprints
of their files: folders of different data may be named the same.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence

from derain.cards.card import DataCard
from derain.sources.frame import Frame
from derain.sources.spread import evenly_spaced
from derain.spec import Spec

# What a record holds: names of sequences, and fingerprints of scans.
SEQUENCES, SCANS = "sequences", "scans"

# A Spec is a small document: of more scans than these, this number is recorded, evenly spread.
MOST_NAMES = 2000


def record_of_sequences(sequences: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Record of a training on sequences of a published data set, as a Spec holds it."""
    names = tuple(sorted(sequences)[:MOST_NAMES])
    return {SEQUENCES: names} if names else {}


def record_of_scans(frames: Sequence[Frame]) -> dict[str, tuple[str, ...]]:
    """Record of a training on some scans, as a Spec holds it.

    Args:
        frames: The scans.

    Raises:
        InputError: A file that cannot be read.
    """
    prints = tuple(sorted({frame.fingerprint() for frame in evenly_spaced(frames, MOST_NAMES)}))
    return {SCANS: prints} if prints else {}


def record_of_parts(
    records: Iterable[tuple[str, Mapping[str, Sequence[str]]]],
) -> dict[str, tuple[str, ...]]:
    """Record of a training on several data sets with a record each.

    Args:
        records: Name of each data set, and its record; there may be several of one name.
    """
    together: dict[str, set[str]] = {}
    for name, record in records:
        for kind, entries in record.items():
            # Sequences of two data sets may be called the same, fingerprints are not.
            entry = _sequences_of(name) if kind == SEQUENCES else kind
            together.setdefault(entry, set()).update(entries)
    return {
        kind: tuple(evenly_spaced(sorted(entries), MOST_NAMES))
        for kind, entries in together.items()
    }


def training_overlap(title: str, spec: Spec, card: DataCard, frames: Sequence[Frame]) -> str | None:
    """The warning about a model that was trained on some of the scans it is measured on.

    Args:
        title: Name of the model.
        spec: Its Spec.
        card: Data card of the scans.
        frames: The scans.

    Returns:
        One sentence; None if it was trained on none of the scans, or nothing is known of it.

    Raises:
        InputError: A scan that cannot be read.
    """
    sequences = {
        *spec.training.get(_sequences_of(card.name), ()),
        *(spec.training.get(SEQUENCES, ()) if spec.data == card.name else ()),
    }
    known = [frame for frame in frames if _trained_on(frame, spec.training, sequences)]
    if not known:
        return None
    return (
        f"{title} was trained on {len(known):,} of these {len(frames):,} scans, such as "
        f"{known[0].name}: its scores do not predict those on others"
    )


def _trained_on(
    frame: Frame, training: Mapping[str, tuple[str, ...]], sequences: Collection[str]
) -> bool:
    if frame.sequence in sequences:
        return True
    return bool(training.get(SCANS)) and frame.fingerprint() in training[SCANS]


def _sequences_of(data: str) -> str:
    """The key of one data set's sequences among those of several."""
    return f"{SEQUENCES} of {data}"
