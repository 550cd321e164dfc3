"""Goes over the scans of a source, and passes over those that cannot be used."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tqdm import tqdm

from derain.errors import InputError
from derain.files.reading import reading
from derain.sources.frame import Frame
from derain.sources.source import Source


class ScanByScan:
    """The frames of a source, one after the other, with a bar that shows how far it is.

    Args:
        source: The source.

    Attributes:
        failed: How many scans were passed over so far.
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self.failed = 0

    def __iter__(self) -> Iterator[Frame]:
        return iter(tqdm(self.source, unit="scan", disable=None))

    @contextmanager
    def passing_over(self, frame: Frame) -> Iterator[None]:
        """Tells what is wrong with one scan and counts it; the others go on.

        Args:
            frame: What the block works on.
        """
        try:
            with reading(Path(frame.name)):  # which knows what to say where the memory is full
                yield
        except InputError as error:
            self.failed += 1
            tqdm.write(f"derain: {error}", sys.stderr)

    def exit_code(self, told: str) -> int:
        """The command's exit code: 2 where scans were passed over, which are told, else 0.

        Args:
            told: What is said of them, with their number as ``{scans}``.
        """
        if not self.failed:
            return 0
        scans = f"{self.failed} of {len(self.source)} scans"
        print(f"derain: {told.format(scans=scans)}", file=sys.stderr)
        return 2
