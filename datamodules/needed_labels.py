"""Which labels are read of a part's scans."""

from derain.datamodules.loading import Part
from derain.sources.frame import Frame
from derain.sources.source import Source


def with_needed_labels(source: Source, part: Part, reads_labels: bool) -> Source:
    """The frames of a part, each with the labels that are read there.

    Prediction reads none, nor does the training of a model that does not learn from labels. In
    such a model's validation they measure and choose nothing: there it reads those it finds.

    Args:
        source: The frames, with what labels they have.
        part: The part.
        reads_labels: Whether the model learns from labels.

    Raises:
        InputError: Labels missing where they are needed.
    """
    if part == "predict" or (part == "train" and not reads_labels):
        return source.map(_without_labels)
    if part == "validation" and not reads_labels:
        return source.map(lambda frame: frame if frame.has_labels else _without_labels(frame))
    for frame in source:
        frame.require_labels()
    return source


def _without_labels(frame: Frame) -> Frame:
    return frame.without_labels()
