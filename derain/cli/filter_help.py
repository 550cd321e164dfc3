"""Help that lists the methods that have names, those of other packages included."""

import argparse

from derain.default import DEFAULT
from derain.filters import FILTERS
from derain.recordings.registry import METHODS

_MODEL = f"the model that comes with derain:\n  {DEFAULT}  see `derain info {DEFAULT}`"
_FILTERS_HERE, _METHODS_HERE = "{filters}", "{methods}"


def list_filters(parser: argparse.ArgumentParser) -> None:
    """Ends the help of a command with the default model and the filters, one a line."""
    parser.formatter_class = _FilterHelp
    parser.epilog = f"{_MODEL}\nfilters:\n{_FILTERS_HERE}"


def list_methods(parser: argparse.ArgumentParser) -> None:
    """Ends the help of a command with these, and the methods that see several scans."""
    list_filters(parser)
    parser.epilog = f"{parser.epilog}\n{_METHODS_HERE}"


class _FilterHelp(argparse.RawDescriptionHelpFormatter):
    """Makes the list when help is asked for.

    Every start of derain makes every parser, and most starts need not look for what other packages
    bring.
    """

    def add_text(self, text: str | None) -> None:
        """Adds a text of the parser's, with the lists where they belong."""
        if text and _FILTERS_HERE in text:
            text = text.replace(_FILTERS_HERE, _listed({n: f.HELP for n, f in FILTERS.items()}))
        if text and _METHODS_HERE in text:
            listed = _listed({name: method.HELP for name, method in METHODS.items()})
            heading = "methods that see several scans of a recording:\n" if listed else ""
            text = text.replace(_METHODS_HERE, heading + listed)
        super().add_text(text)


def _listed(helps: dict[str, str]) -> str:
    """Names, a line each, and what stands for each."""
    width = max(map(len, helps), default=0)
    return "\n".join(f"  {name:{width}}  {help_}".rstrip() for name, help_ in helps.items())
