"""The parser of the command line, whose errors are one line with a remedy."""

import argparse
import math
import re
from collections.abc import Callable, Sequence
from itertools import takewhile
from typing import Any, NoReturn

from derain.errors import InputError, did_you_mean

# Options of other programs that choose a GPU.
GPU_OPTIONS = {"--gpu", "--gpus", "--device", "--cuda", "--accelerator"}


def whole(text: str) -> int:
    """A whole number."""
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text} is not a whole number") from None


def number(text: str) -> float:
    """A finite number."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text} is not a number")
    return value


# Shows the options that are rarely used, too.
HELP_ALL = "--help-all"


class Parser(argparse.ArgumentParser):
    """Raises InputError for a command line that it cannot understand.

    Where it has options that are rarely used, ``--help`` fits a screen: its description ends with
    the first examples, and those options are left to ``--help-all``.

    Attributes:
        late_epilog: Makes the end of the help when the help is printed; None without one.
    """

    late_epilog: Callable[[], str] | None = None

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._rare: dict[argparse.Action, str | None] = {}
        self._whole_description: str | None = None
        # Instead of int and float, whose names would appear in the messages.
        self.register("type", int, whole)
        self.register("type", float, number)

    def use_rarely(self, *options: str) -> None:
        """Leaves options, and all but the first examples, to ``--help-all``.

        Args:
            options: Each by one of its names.
        """
        text = "show all options, with full explanations"
        self.add_argument(HELP_ALL, action=_HelpAll, nargs=0, help=text)
        self._whole_description = self.description
        self.description = _first_examples(self.description or "")
        for option in options:
            action = self._option_string_actions[option]
            self._rare[action], action.help = action.help, argparse.SUPPRESS

    def format_help(self) -> str:
        """The help with its end."""
        if self.late_epilog is not None:
            self.epilog = self.late_epilog()
        return super().format_help()

    def format_whole_help(self) -> str:
        """The help with all options, from here on."""
        self.description = self._whole_description
        for action, text in self._rare.items():
            action.help = text
        return self.format_help()

    def error(self, message: str) -> NoReturn:
        """Refuses a command line, with an example of a right one where something is missing."""
        argument, colon, reason = message.removeprefix("argument ").partition(": ")
        if message.startswith("argument ") and colon:
            raise InputError(argument, reason, f"`{self.prog} --help` explains it.")
        command = self.prog.partition(" ")[2] or "command line"
        # METHOD may be left out, so what is missing is a scan.
        reason, example = message.replace("[METHOD]", "SCAN"), self._example()
        remedy = f"For example: `{example}`. `{self.prog} --help` explains the rest."
        raise InputError(command, reason, remedy)

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: Any = None
    ) -> tuple[Any, list[str]]:
        """Parses the options of a command; refuses unknown ones."""
        if args is not None:
            self._refuse_unknown_options(args)
        return super().parse_known_args(args, namespace)

    def _refuse_unknown_options(self, words: Sequence[str]) -> None:
        """Refuses a misspelt option, before argparse reports the right one as missing."""
        options = self._option_string_actions
        before_names = words[: words.index("--")] if "--" in words else words
        dashes = "--"  # a word with one may be a negative number
        if self._subparsers is not None:  # the options behind a command's name are the command's
            before_names, dashes = list(takewhile(lambda word: word[:1] == "-", words)), "-"
        for word in before_names:
            name = word.partition("=")[0]
            if not name.startswith(dashes) or any(one.startswith(name) for one in options):
                continue
            remedy = f"{did_you_mean(name, options)}`{self.prog} --help` lists its options."
            if name in GPU_OPTIONS:
                remedy = "Leave it out: derain runs models on the CPU."
            raise InputError(name, f"`{self.prog}` has no such option", remedy)

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            named = "/".join(action.option_strings) or str(action.metavar)
            remedy = f"{did_you_mean(value, action.choices)}Available: {', '.join(action.choices)}."
            raise InputError(named, f"there is no {value}", remedy)

    def _example(self) -> str:
        """The first of the examples in the description."""
        text = re.sub(r" *\\\n *", " ", self.description or "")
        found = re.search(rf"^ *({self.prog} \S.*?)(  |$)", text, re.MULTILINE)
        return found[1] if found else f"{self.prog} --help"


class _HelpAll(argparse.Action):
    """Prints the whole help and ends the program."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        assert isinstance(parser, Parser)
        print(parser.format_whole_help(), end="")
        parser.exit()


def _first_examples(description: str) -> str:
    """A description up to the end of its first examples, which are indented."""
    paragraphs = description.split("\n\n")
    with_examples = [place for place, text in enumerate(paragraphs) if text.startswith("  ")]
    return "\n\n".join(paragraphs[: with_examples[0] + 1 if with_examples else None])
