"""Tables whose columns line up."""

import math

import pytest

from derain.evaluation.text_tables import markdown_table, number_text, plain_table


@pytest.mark.parametrize(
    ("value", "text"), [(0.12345, "0.123"), (0, "0.000"), (math.nan, "-"), (None, "-")]
)
def test_a_number_that_is_undefined_is_a_dash(value: float | None, text: str) -> None:
    assert number_text(value) == text


def test_a_table_in_markdown_lines_up() -> None:
    text = markdown_table(["method", "IoU"], [["a", "0.5"], ["longer one", "0.25"]])
    assert text.splitlines() == [
        "| method     |  IoU |",
        "|------------|-----:|",
        "| a          |  0.5 |",
        "| longer one | 0.25 |",
    ]


def test_a_plain_table_lines_up_without_blanks_at_its_ends() -> None:
    text = plain_table([["", "all", "share"], ["scans", "12", ""], ["rain", "3", "25%"]])
    assert text.splitlines() == [
        "         all  share",
        "  scans   12",
        "  rain     3    25%",
    ]
