"""Goes over the scans of a source, and passes over those that cannot be used."""

import sys
from collections.abc import Iterator

from tqdm import tqdm

from derain.errors import InputError
from derain.sources.frame import Frame
from derain.sources.judging import Failures
from derain.sources.source import Source


class ScanByScan(Failures):
    """The frames of a source, one after the other, with a progress bar.

    It prints what is wrong with single scans, and goes on with the others.

    Args:
        source: The source.
    """

    def __init__(self, source: Source) -> None:
        super().__init__(print_error)
        self._source = source

    def __iter__(self) -> Iterator[Frame]:
        return iter(tqdm(self._source, unit="scan", disable=None))


def exit_code(failed: int, scans: int, outcome: str) -> int:
    """The command's exit code: 2 where scans failed, which it prints, else 0.

    Args:
        failed: Number of scans that failed.
        scans: Number of all scans.
        outcome: What became of those that failed, with their number as ``{scans}``.
    """
    if not failed:
        return 0
    print(f"derain: {outcome.format(scans=f'{failed} of {scans} scans')}", file=sys.stderr)
    return 2


def print_error(error: InputError) -> None:
    """Prints an error on stderr, above a progress bar."""
    tqdm.write(f"derain: {error}", sys.stderr)
