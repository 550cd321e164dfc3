"""Telling of what is odd about scans: each kind once, and how many more have it."""

import sys
from collections import Counter
from collections.abc import Iterable

from tqdm import tqdm

from derain.errors import printable
from derain.views.oddities import Oddity


class Notices:
    """Warns on stderr of what is odd, each kind with the first scan that has it.

    A folder's scans mostly have the same fault, with other numbers: the first one speaks for all
    of its kind, and the end says how many more there were.
    """

    def __init__(self) -> None:
        self._seen: Counter[str] = Counter()

    def tell(self, scan: str, oddities: Iterable[Oddity], method: str = "") -> None:
        """Warns of a scan.

        Args:
            scan: Its name.
            oddities: What is odd about it.
            method: Title of the method that finds it so, where there are several.
        """
        prefix = f"{method}: " if method else ""
        for oddity in oddities:
            self._seen[prefix + oddity.kind] += 1
            if self._seen[prefix + oddity.kind] == 1:
                warn(f"{scan}: {prefix}{oddity.detail}")

    def tell_how_many_more(self) -> None:
        """Says of each kind how many more scans had it."""
        for kind, scans in self._seen.items():
            if scans > 1:
                more = "1 more scan" if scans == 2 else f"{scans - 1:,} more scans"
                warn(f"{more}: {kind}")


def warn(text: str) -> None:
    """Warns on stderr, in one line.

    Args:
        text: Of what.
    """
    # Not print: a progress bar may stand in the line.
    tqdm.write(f"derain: warning: {printable(text)}", sys.stderr)
