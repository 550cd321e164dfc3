"""The one error a user meets."""

from pathlib import Path


class InputError(ValueError):
    """Something the user gave cannot be used.

    The command line prints it on one line and exits with code 2.

    Args:
        subject: What it is about: a file, a folder or an option.
        reason: What is wrong with it.
        remedy: What the user can do.
    """

    def __init__(self, subject: str | Path, reason: str, remedy: str) -> None:
        reason = " ".join(reason.split())  # what other libraries say may run over several lines
        super().__init__(f"{subject}: {reason}. {remedy}")
        self.subject = subject
        self.reason = reason
        self.remedy = remedy

    def __reduce__(self) -> tuple[type["InputError"], tuple[str | Path, str, str]]:
        # An error crosses the process boundary of a data loader's worker by pickling.
        return type(self), (self.subject, self.reason, self.remedy)
