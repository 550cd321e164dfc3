"""Help that lists the filters there are, those of other packages included."""

import argparse

from derain.filters import FILTERS

_FILTERS_HERE = "{filters}"


def list_filters(parser: argparse.ArgumentParser) -> None:
    """Ends the help of a command with the filters, one a line."""
    parser.formatter_class = _FilterHelp
    parser.epilog = f"filters:\n{_FILTERS_HERE}"


class _FilterHelp(argparse.RawDescriptionHelpFormatter):
    """Makes the list when help is asked for.

    Every start of derain makes every parser, and most starts need not look for what other packages
    bring.
    """

    def add_text(self, text: str | None) -> None:
        """Adds a text of the parser's, with the list where it belongs."""
        if text and _FILTERS_HERE in text:
            width = max(map(len, FILTERS))
            lines = (f"  {name:{width}}  {kind.HELP}".rstrip() for name, kind in FILTERS.items())
            text = text.replace(_FILTERS_HERE, "\n".join(lines))
        super().add_text(text)
