"""Which scans a network was trained on, so that it is not measured on them unawares.

Sequences of a published data set are recorded by their names, and all other scans by fingerprints
of their files: everybody's folders may be called the same.
"""

from collections.abc import Iterable, Mapping, Sequence

from derain.cards.card import DataCard
from derain.sources.frame import Frame
from derain.sources.spread import evenly_spaced
from derain.spec import Spec

# What a record holds: names of sequences, and fingerprints of scans.
SEQUENCES, SCANS = "sequences", "scans"

# A Spec is a small document: of more scans than these, so many are recorded, evenly spread.
MOST_NAMES = 2000


def by_name(sequences: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Record of a training on sequences of a published data set, as a Spec holds it."""
    names = tuple(sorted(sequences)[:MOST_NAMES])
    return {SEQUENCES: names} if names else {}


def by_fingerprint(frames: Sequence[Frame]) -> dict[str, tuple[str, ...]]:
    """Record of a training on some scans, as a Spec holds it.

    Args:
        frames: The scans.

    Raises:
        InputError: A file that cannot be read.
    """
    prints = tuple(sorted({frame.fingerprint() for frame in evenly_spaced(frames, MOST_NAMES)}))
    return {SCANS: prints} if prints else {}


def overlap(title: str, spec: Spec, card: DataCard, frames: Sequence[Frame]) -> str | None:
    """What is to be said of a model that was trained on some of the scans it is measured on.

    Args:
        title: What the model is called.
        spec: Its Spec.
        card: Data card of the scans.
        frames: The scans.

    Returns:
        One sentence; None where it was trained on none of the scans, or nothing is known of it.

    Raises:
        InputError: A scan that cannot be read.
    """
    same_data = spec.data == card.name
    known = [frame for frame in frames if _trained_on(frame, spec.training, same_data)]
    if not known:
        return None
    return (
        f"{title} was trained on {len(known):,} of these {len(frames):,} scans, such as "
        f"{known[0].name}: its scores say little of others"
    )


def _trained_on(frame: Frame, training: Mapping[str, tuple[str, ...]], same_data: bool) -> bool:
    if same_data and frame.sequence in training.get(SEQUENCES, ()):
        return True
    return bool(training.get(SCANS)) and frame.fingerprint() in training[SCANS]
