"""Tables whose columns line up."""

from derain.evaluation.text_tables import markdown_table, plain_table


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
