"""How probable rain is, as a column of the scans that a command writes."""

from pathlib import Path

from derain.errors import InputError
from derain.files.columns import with_column
from derain.files.format import format_of
from derain.scan import Scan
from derain.sources.cleaned_bags import RAIN_PROBABILITY
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.method import Method
from derain.sources.source import Source


def refuse_improbable(method: Method, source: Source) -> None:
    """Refuses, before any work, a method without probabilities, and files without a place for them.

    Of each kind of files the first is read; what else is wrong with it is told in its turn.

    Args:
        method: The method.
        source: What is read.

    Raises:
        InputError: The method knows no probabilities, or a file does not name its columns.
    """
    if not method.gives_probabilities:
        raise InputError(
            "--probability",
            f"{method.as_dict()['method']} says which points are rain, and not how probably",
            "Leave it out, or take a model or persistence.",
        )
    for frame in {frame.suffix: frame for frame in reversed(source)}.values():
        try:
            scan = frame.read()
        except InputError:
            continue
        _refuse_nameless(frame, scan)


def with_probability(frame: Frame, judgement: Judgement) -> Scan:
    """The scan that a method judged, with the column; one that it had of this name is replaced.

    Raises:
        InputError: Its file does not name its columns.
    """
    _refuse_nameless(frame, judgement.scan)
    return with_column(judgement.scan, RAIN_PROBABILITY, judgement.probability)


def _refuse_nameless(frame: Frame, scan: Scan) -> None:
    """Refuses a file in which a further column would have no name."""
    if frame.suffix and not format_of(Path(frame.name)).names_columns(scan):
        raise InputError(
            frame.name,
            f"the columns of such a file have no names, so that none can be {RAIN_PROBABILITY}",
            "Leave --probability out, or convert the scans, to .pcd or .npz for instance.",
        )
