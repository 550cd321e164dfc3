"""What ``derain info default`` says: the card of the model that comes with derain, as text."""

from collections.abc import Iterator, Sequence
from textwrap import wrap

from derain.default import ModelCard, ModelScore
from derain.evaluation.text_tables import number_text

# Letters of a line, as in every document of derain.
LINE_LENGTH = 100


def card_as_text(card: ModelCard, size: int) -> str:
    """A card in lines for the screen.

    Args:
        card: The card.
        size: Bytes of the model's file.
    """
    return "\n".join(
        [
            f"{card.title}, {size:,} bytes",
            *_part("what it is", card.what),
            *_part("when not to use it", *card.not_for),
            *_part("how good it is", *_scores(card.scores)),
            *_part("measured by", card.measured),
            *_part("threshold", f"{card.threshold:g}: {card.threshold_chosen}"),
            *_part("learnt from", card.data),
            *_part("made by", *card.training),
            *_part("seed", str(card.seed)),
            *_part("licence", card.licence),
            *_part("sha256", card.sha256),
        ]
    )


def _part(heading: str, *paragraphs: str) -> Iterator[str]:
    """A heading and what stands below it; of several paragraphs, further lines are set in."""
    yield f"  {heading}:"
    hanging = "    " if len(paragraphs) == 1 else "      "
    for paragraph in paragraphs:
        # As it is where it fits, for tables have columns.
        fits = len(paragraph) <= LINE_LENGTH - 4
        lines = [paragraph] if fits else wrap(paragraph, LINE_LENGTH - 6, break_long_words=False)
        yield f"    {lines[0]}"
        yield from (f"{hanging}{line}" for line in lines[1:])


def _scores(scores: Sequence[ModelScore]) -> list[str]:
    """A table of scores: a line of headings, and a line for each data set."""
    if not scores:
        return ["not measured"]
    width = max(len(score.data) for score in scores)
    return [
        f"{'':{width}}      P      R    IoU    taken",
        *(
            f"{score.data:{width}}  {number_text(score.precision):>5}"
            f"  {number_text(score.recall):>5}  {number_text(score.iou):>5}"
            f"  {number_text(score.taken, '.3%'):>7}"
            for score in scores
        ),
    ]
