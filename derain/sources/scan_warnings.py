"""Python warnings of what is odd about scans, for programs that judge them."""

import sys
import warnings
from collections.abc import Callable, Iterable

from derain.errors import ScanWarning
from derain.sources.judgement import Judgement
from derain.views.scan_issues import ScanIssue, much_removed

# One scan in so many is examined, the first among them. It takes 3 to 7 milliseconds of 116,000
# points, a tenth of what a filter takes; the scans of one sensor mostly have the same fault.
EXAMINE_EVERY = 100


class ScanWarnings:
    """Warns of what is odd about scans, of each kind of fault once.

    Args:
        examine: What is odd about a scan that was judged.
        examined_of: One scan in so many is examined; the share of rain is looked at in each.
    """

    def __init__(
        self, examine: Callable[[Judgement], Iterable[ScanIssue]], examined_of: int = EXAMINE_EVERY
    ) -> None:
        self._examine = examine
        self._examined_of = examined_of
        self._judged = 0
        self._kinds: set[str] = set()

    def check(self, judgement: Judgement) -> None:
        """Warns of a scan that was judged, if it is its turn."""
        odd = [*much_removed(judgement.share_of_rain)]
        if self._judged % self._examined_of == 0:
            odd += self._examine(judgement)
        self._judged += 1
        for issue in odd:
            if issue.kind not in self._kinds:
                self._kinds.add(issue.kind)
                text = f"{judgement.scan.name}: {issue.detail}"
                warnings.warn(text, ScanWarning, stacklevel=_level_of_the_user())


def _level_of_the_user() -> int:
    """The level of the stack, as warnings.warn counts from who calls this, outside derain."""
    level, frame = 1, sys._getframe(1)
    while frame.f_back and frame.f_globals.get("__name__", "").startswith("derain."):
        level, frame = level + 1, frame.f_back
    return level
