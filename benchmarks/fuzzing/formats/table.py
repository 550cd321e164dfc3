"""Lines of text (`.csv`, `.txt`, `.xyz`, `.asc`)."""

from collections.abc import Callable, Sequence

from benchmarks.fuzzing.format_inputs import INPUTS, FormatInputs, lines


@INPUTS.add(".asc", ".csv", ".txt", ".xyz")
class TableInputs(FormatInputs):
    """Tables, with and without names, of commas and of white space."""

    def hostile(self, suffix: str) -> Sequence[Callable[[], bytes]]:
        """Far too many columns, a number of a million digits, and a quote without an end."""
        return (
            lambda: b"1," * 100_000 + b"1\n",
            lambda: b"x,y,z\n1,2," + b"9" * 10**6 + b"\n",
            lambda: b'x,y,z\n1,2,"3\n' + b"1,2,3\n" * 10_000,
        )

    def by_others(self, suffix: str) -> Sequence[bytes]:
        """As spreadsheets write them; the others are as derain does."""
        if suffix != ".csv":
            return ()
        return (
            b"x,y,z,intensity\n" + lines().replace(b" ", b","),
            b'"x","y","z","name"\r\n1,2,3,4\r\n5,6,,8\r\n',
        )
