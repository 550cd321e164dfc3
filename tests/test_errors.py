"""Messages are one line that a terminal can show."""

import os
import pickle

import pytest

from derain.errors import LONGEST_REASON, InputError, reason_of


def test_what_a_terminal_must_not_be_sent_is_escaped() -> None:
    name = os.fsdecode(b"scan\x1b[2J\n\xff.bin")
    error = InputError(name, "the reason\x07 of\nit\u202e", "Remedy.\r")
    assert str(error) == (r"scan\x1b[2J\n\udcff.bin: the reason\x07 of it\u202e. Remedy.\r")
    assert str(error).encode()


def test_words_in_other_scripts_stay() -> None:
    assert str(InputError("日本語 é.bin", "größer", "Да.")) == "日本語 é.bin: größer. Да."


def test_a_long_reason_is_cut() -> None:
    assert len(str(InputError("file", "x" * 10**7, "Remedy."))) < LONGEST_REASON + 50


def test_an_error_crosses_processes() -> None:
    error = InputError("file", "x" * 10**4, "Remedy.")
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (ValueError("a bad\n  value"), "a bad value"),
        (InputError("scan.bin", "it is damaged", "Write it again."), None),
        (AssertionError(), "AssertionError"),
    ],
)
def test_the_reason_of_an_error_is_one_line_and_never_empty(
    error: Exception, told: str | None
) -> None:
    assert reason_of(error) == (told or str(error))
