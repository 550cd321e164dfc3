"""Sources of scans: frames in time order."""

from collections.abc import Callable, Iterable

from derain.scan import Array, Scan
from derain.sources.frame import Frame, MemoryFrame


class Frames(tuple[Frame, ...]):
    """A source of scans: frames in time order, one sequence after the other.

    Nothing is read before a frame's ``read``.

    Example:
        >>> import numpy as np
        >>> scans = [np.random.default_rng(number).normal(size=(100, 4)) for number in range(3)]
        >>> source = Frames.of_scans([Scan.of(points) for points in scans])
        >>> len(source), source[1].key, len(source[1].read())
        (3, '000001', 100)

    Args:
        frames: The frames.
    """

    @classmethod
    def of_scans(cls, scans: Iterable[Scan | Array], sequence: str = "") -> "Frames":
        """Scans in memory as one sequence, with the labels that they have.

        Several sequences are one source by ``Frames([*first, *second])``.

        Args:
            scans: The scans, or arrays of points as :meth:`derain.scan.Scan.of` takes them, in time
                order.
            sequence: Name of the sequence; its frames have keys such as ``drive/000001``.

        Raises:
            InputError: Something that is neither a scan nor an array of points.
        """
        folder = f"{sequence}/" if sequence else ""
        return cls(
            MemoryFrame(key=f"{folder}{number:06d}", sequence=sequence, number=number, scan=scan)
            for number, scan in enumerate(map(Scan.of, scans))
        )

    def map(self, change: Callable[[Frame], Frame]) -> "Frames":
        """The same frames, each changed, such as to be without labels."""
        return Frames(map(change, self))


# What functions call the frames that they take.
Source = Frames
