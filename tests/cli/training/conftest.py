"""What tests of Lightning's commands share."""

from collections.abc import Callable

import lightning.pytorch  # noqa: F401  here, for its log keeps the stderr that it is imported with
import pytest


@pytest.fixture(autouse=True)
def _own_folder(here) -> None:
    """Runs, checkpoints and predictions go to a folder of the test's own."""


@pytest.fixture
def last_line(run_derain) -> Callable[..., str]:
    """Runs a command that is refused with exit code 2; gives the line after Lightning's own."""

    def run(*arguments: object) -> str:
        outcome = run_derain(*arguments)
        assert outcome.code == 2
        assert "Traceback" not in outcome.err
        line = outcome.err.splitlines()[-1]
        assert line.startswith("derain: ")
        return line.removeprefix("derain: ")

    return run
