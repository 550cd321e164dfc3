"""The error and the warning for users, and suggestions for misspelt names."""

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path

# Longer reasons cannot be read: a damaged file may put millions of characters into one.
LONGEST_REASON = 1000

# The longest path of Linux has 4,096 bytes; the name of a part of the file follows it.
LONGEST_SUBJECT = 5000


class InputError(ValueError):
    """An input of the user cannot be used.

    The command line prints it on one line and exits with code 2.

    Example:
        >>> try:
        ...     derain.read_scan("missing.pcd")
        ... except InputError as error:
        ...     print(error)
        missing.pcd: there is no such file. Check the path.

    Args:
        subject: The input: a file, a folder or an option.
        reason: The fault of the input.
        remedy: The step that the user can take.
    """

    def __init__(self, subject: str | Path, reason: str, remedy: str) -> None:
        # Messages of other libraries may have several lines, and a full stop.
        reason = " ".join(reason.split()).removesuffix(".")
        reason, remedy = _cut(reason, LONGEST_REASON), _cut(remedy, LONGEST_REASON)
        super().__init__(printable(f"{_cut(str(subject), LONGEST_SUBJECT)}: {reason}. {remedy}"))
        self.subject = subject
        self.reason = reason
        self.remedy = remedy

    def renaming_option(self, old: str, new: str) -> "InputError":
        """The same error, with one option named in place of another."""
        texts = str(self.subject), self.reason, self.remedy
        return InputError(*(text.replace(old, new) for text in texts))

    def __reduce__(self) -> tuple[type["InputError"], tuple[str | Path, str, str]]:
        # An error crosses the process boundary of a data loader's worker by pickling.
        return type(self), (self.subject, self.reason, self.remedy)


def did_you_mean(name: object, names: Iterable[str]) -> str:
    """The beginning of a remedy for an unknown name: a question if a known name is similar.

    Args:
        name: The name that the user gave.
        names: The known names.
    """
    alike = get_close_matches(str(name)[:LONGEST_REASON], list(names), n=1)
    return f"Did you mean {alike[0]}? " if alike else ""


class ScanWarning(UserWarning):
    """The category of warnings in Python about a scan that may not suit the method that judges it.

    Commands print the same on stderr: coordinates that are not those of one sensor in metres,
    intensities in another unit or not measured, channels that the scan lacks, many points outside
    the grid of a model, or more points called rain than in any rain. A method warns of each of
    these once. It examines its first scan and one in a hundred after that, and checks the share of
    rain in every scan.

    Example:
        >>> import warnings
        >>> with warnings.catch_warnings(record=True) as caught:
        ...     warnings.simplefilter("always")
        ...     rain = derain.Derainer()(np.random.default_rng(0).normal(0, 0.1, (1000, 3)))
        >>> [warning.category.__name__ for warning in caught][0]
        'ScanWarning'
    """


def _cut(text: str, longest: int) -> str:
    return text if len(text) <= longest else f"{text[:longest]} ..."


def printable(text: str) -> str:
    """The text with escapes in place of control characters, which a terminal must not receive.

    Names and contents of files may hold control sequences, line breaks, marks that change the
    direction of writing, and bytes that are not text.
    """
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def counted(number: int, thing: str) -> str:
    """A number of things as text, such as ``1 scan`` and ``2,014 scans``."""
    return f"{number:,} {thing}{'' if number == 1 else 's'}"


def reason_of(error: Exception) -> str:
    """The message of an error in one line; its class if it has none, as a bare assert."""
    return " ".join(str(error).split()) or type(error).__name__
