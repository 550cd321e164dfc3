"""Python warnings of what is odd about scans, for programs that judge them."""

import sys
import warnings
from collections.abc import Callable, Iterable

from derain.errors import ScanWarning
from derain.sources.judgement import Judgement
from derain.views.oddities import Oddity, much_removed

# One scan in so many is examined, the first among them. It takes 3 to 7 milliseconds of 116,000
# points, a tenth of what a filter takes; the scans of one sensor mostly have the same fault.
EXAMINED_OF = 100


class ScanWarnings:
    """Warns of what is odd about scans, of each kind of fault once.

    Args:
        examine: What is odd about a scan that was judged.
        examined_of: One scan in so many is examined; the share of rain is looked at in each.
    """

    def __init__(
        self, examine: Callable[[Judgement], Iterable[Oddity]], examined_of: int = EXAMINED_OF
    ) -> None:
        self._examine = examine
        self._examined_of = examined_of
        self._judged = 0
        self._kinds: set[str] = set()

    def look(self, judgement: Judgement) -> None:
        """Warns of a scan that was judged, if it is its turn."""
        odd = [*much_removed(judgement.share_of_rain)]
        if self._judged % self._examined_of == 0:
            odd += self._examine(judgement)
        self._judged += 1
        for oddity in odd:
            if oddity.kind not in self._kinds:
                self._kinds.add(oddity.kind)
                text = f"{judgement.scan.name}: {oddity.detail}"
                warnings.warn(text, ScanWarning, stacklevel=_level_of_the_user())


def _level_of_the_user() -> int:
    """The level of the stack, as warnings.warn counts from who calls this, outside derain."""
    level, frame = 1, sys._getframe(1)
    while frame.f_back and frame.f_globals.get("__name__", "").startswith("derain."):
        level, frame = level + 1, frame.f_back
    return level
