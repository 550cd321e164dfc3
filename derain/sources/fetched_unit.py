"""Units whose scans and bags are in object stores: fetched to be cleaned."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

from derain.errors import InputError
from derain.sources.frame import Frame
from derain.sources.stored_frame import StoredFrame
from derain.sources.units import FrameUnit
from derain.stores.mirror import Mirror, mirror


@contextmanager
def fetched(unit: FrameUnit) -> Iterator[tuple[FrameUnit, Callable[[InputError], InputError]]]:
    """Lends a unit, all files of which are on this machine while the block runs.

    Args:
        unit: The unit, with frames of this machine or of stores.

    Yields:
        The unit with frames of this machine, and what names URLs in errors in place of its files.

    Raises:
        InputError: A scan or a bag of a store cannot be fetched whole. Then nothing of the unit is
            done, for what is found of one scan may depend on the others.
    """
    frames = (*unit.before, *unit.frames, *unit.after)
    objects = [each for frame in frames if isinstance(frame, StoredFrame) for each in frame.objects]
    if not objects:
        yield unit, lambda error: error
        return
    with mirror() as where:
        where.fetch(objects)
        here = replace(
            unit,
            frames=_fetched(unit.frames, where),
            before=_fetched(unit.before, where),
            after=_fetched(unit.after, where),
        )
        yield here, where.error_with_urls


def _fetched(frames: tuple[Frame, ...], where: Mirror) -> tuple[Frame, ...]:
    found: list[Frame] = []
    for frame in frames:
        found += frame.fetched(where) if isinstance(frame, StoredFrame) else [frame]
    return tuple(found)
