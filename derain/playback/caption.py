"""The text beside the pictures: which scan it is, and what the colours mean."""

from pathlib import Path

from derain.errors import printable
from derain.pictures.palette import LOST, MISSED, OUTCOMES, RAIN, SOLID
from derain.scan import Scan
from derain.sources.frame import Frame

# What the colours of the palette are called.
NAMES = {SOLID: "grey", RAIN: "blue", MISSED: "yellow", LOST: "red"}

# What the colours mean where nobody knows what is rain.
WITHOUT_LABELS = {"kept": SOLID, "removed": RAIN}

PROBABILITY = "Probability of rain: dark, blue, white, ever higher"


def caption(frame: Frame, scan: Scan, labels: str | None, held_out: bool) -> str:
    """The text of one scan, in Markdown.

    Args:
        frame: The frame.
        scan: Its scan.
        labels: What labels are called by which rain is known; None where there are none.
        held_out: Whether nothing was learnt from it, where something was.
    """
    which = f"**{_plain(frame.key)}**, {len(scan):,} points" + ", held out" * held_out
    by = f"Rain is what the {labels} calls so." if labels else "No labels: nobody knows better."
    coloured = OUTCOMES if labels else WITHOUT_LABELS
    meanings = "\n".join(f"- {NAMES[colour]}: {meaning}" for meaning, colour in coloured.items())
    return f"{which}\n\n{meanings}\n\n{by} {PROBABILITY}.\n"


def file_name(frame: Frame) -> str:
    """What a recording is called: the folder or the file of its first scan."""
    return printable(frame.sequence or Path(frame.name).name)


def _plain(text: str) -> str:
    """A name without what Markdown would read as marks."""
    return "".join(f"\\{c}" if c in "\\`*_{}[]<>()#+-!|" else c for c in printable(text))
