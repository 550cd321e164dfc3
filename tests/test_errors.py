"""Messages are one line that a terminal can show."""

import os
import pickle

from derain.errors import LONGEST_REASON, InputError, counted, reason_of


def test_what_a_terminal_must_not_be_sent_is_escaped_and_other_scripts_stay() -> None:
    name = os.fsdecode(b"scan\x1b[2J\n\xff.bin")
    error = InputError(name, "the reason\x07 of\nit\u202e größer.", "Да.\r")
    assert str(error) == (r"scan\x1b[2J\n\udcff.bin: the reason\x07 of it\u202e größer. Да.\r")
    assert str(error).encode()


def test_a_long_reason_is_cut_also_in_another_process() -> None:
    error = InputError("file", "x" * 10**7, "Remedy.")
    assert len(str(error)) < LONGEST_REASON + 50
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


def test_the_reason_of_an_error_is_one_line_and_never_empty() -> None:
    assert reason_of(ValueError("a bad\n  value")) == "a bad value"
    assert reason_of(AssertionError()) == "AssertionError"


def test_one_thing_is_counted_in_the_singular() -> None:
    assert [counted(number, "scan") for number in (0, 1, 2014)] == [
        "0 scans",
        "1 scan",
        "2,014 scans",
    ]
