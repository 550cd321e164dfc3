"""Draws one scan as each method cleans it, a picture a method, for the pages of docs/methods.

docs/methods/index.md has the commands that make the scan and the networks.
"""

import argparse
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

from derain.cards.card import load_card
from derain.evaluation.counts import Counts
from derain.export.methods import load_method
from derain.pictures.palette import outcomes
from derain.pictures.scan_pictures import draw_columns, explain_colours
from derain.scan import Bools, Scan
from derain.sources.folders import named_frames
from derain.sources.source import Source

METHODS = ("default", "persistence", "crf", "dror", "dsor", "ror", "sor", "ssr")

# Metres that the picture from above shows: to each side, and ahead. Most rain is met nearer.
ASIDE, AHEAD = 10.0, 20.0

# Colours in a file: those of the points, and shades between them.
COLOURS = 64


def main() -> None:
    """Draws the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path, help="folder of consecutive labelled scans")
    parser.add_argument("--card", default="rehearse3d", help="data card of their labels")
    parser.add_argument("--methods", nargs="+", default=METHODS, metavar="[TITLE=]METHOD")
    parser.add_argument("--out", type=Path, required=True, help="folder of the pictures")
    arguments = parser.parse_args()

    frames = named_frames([arguments.recording], labelled=True)
    number = len(frames) // 2
    frame = frames[number]
    card = load_card(arguments.card)
    scan = frame.read()
    labelled = scan.with_label(frame.read_label(len(scan)))
    for named in arguments.methods:
        title, _, method = named.rpartition("=")
        predicted = judged(method, frames, number)
        write(labelled, predicted, card.rain_of(labelled), arguments.out / f"{title or method}.png")


def judged(name: str, frames: Source, number: int) -> Bools:
    """The rain that a method finds in one scan of a recording, bool (N,)."""
    method = load_method(name, {})
    judgements = [method.push(frame) for frame in frames]
    answered = [*filter(None, judgements), *method.flush()]
    return answered[number].rain


def write(scan: Scan, predicted: Bools, rain: Bools, path: Path) -> None:
    """Draws a scan from above and as the sensor sees it, coloured by the outcome of its points."""
    figure = Figure(figsize=(10, 4.4), layout="constrained")
    counts = Counts.of(predicted, rain)
    figure.suptitle(
        f"{path.stem}: precision {counts.precision:.2f}, recall {counts.recall:.2f} "
        "(simulated rain)",
        fontsize=10,
    )
    pair = figure.subplots(1, 2, width_ratios=(1, 1.6))
    draw_columns(pair[None], [("", scan, outcomes(predicted, rain))])
    pair[0].set(xlim=(-ASIDE, ASIDE), ylim=(0, AHEAD))
    explain_colours(figure)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100)
    Image.open(path).convert("RGB").quantize(COLOURS, Image.Quantize.FASTOCTREE).save(path)


if __name__ == "__main__":
    main()
