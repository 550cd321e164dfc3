"""The text beside the pictures: which scan it is, and what the colours mean."""

from pathlib import Path

from derain.errors import printable
from derain.pictures.palette import LOST, MISSED, OUTCOMES, RAIN, SOLID, WITHOUT_LABELS
from derain.playback.labels import Labels
from derain.scan import Scan
from derain.sources.frame import Frame

# What the colours of the palette are called.
COLOUR_NAMES = {SOLID: "grey", RAIN: "blue", MISSED: "yellow", LOST: "red"}

PROBABILITY_TEXT = "Probability of rain: dark, blue, white, ever higher"


def caption(frame: Frame, scan: Scan, labels: Labels | None, held_out: bool) -> str:
    """The text of one scan, in Markdown.

    Args:
        frame: The frame.
        scan: Its scan.
        labels: Labels by which its rain is known; None where it has none.
        held_out: Whether nothing was learnt from it, where something was.
    """
    which = f"**{_plain(frame.key)}**, {len(scan):,} points" + ", held out" * held_out
    by = _by(labels) if labels else "No labels: nobody knows better."
    coloured = OUTCOMES if labels else WITHOUT_LABELS
    meanings = "\n".join(
        f"- {COLOUR_NAMES[colour]}: {meaning}" for meaning, colour in coloured.items()
    )
    return f"{which}\n\n{meanings}\n\n{by} {PROBABILITY_TEXT}.\n"


def _by(labels: Labels) -> str:
    known = f"Rain is what the {labels.name} calls so"
    if not labels.card.unknown:
        return f"{known}."
    return f"{known}; in its own view, yellow is what it does not know."


def file_name(frame: Frame) -> str:
    """What a recording is called: the folder or the file of its first scan."""
    return printable(frame.sequence or Path(frame.name).name)


def _plain(text: str) -> str:
    """A name without what Markdown would read as marks."""
    return "".join(f"\\{c}" if c in "\\`*_{}[]<>()#+-!|" else c for c in printable(text))
