"""One line for what Lightning's command line, its trainer or the system refuses."""

import difflib
import re
import traceback
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager

from jsonargparse import ArgumentParser
from lightning.fabric.utilities.exceptions import MisconfigurationException

from derain.errors import InputError, did_you_mean
from derain.models.former_names import FORMER_OPTIONS

# Steps of a key in a file that an option on the command line leaves out.
IMPLIED = ("class_path", "init_args")

# How jsonargparse names an option that it does not know, on the command line and in a file.
_UNKNOWN = (
    re.compile(r"unrecognized arguments: --(?P<key>[^\s=]+)"),
    re.compile(r"Group '(?P<group>[^']+)' does not accept option '(?P<key>[^']+)'"),
    re.compile(r"does not accept option '(?P<key>[^']+)'"),
    re.compile(r"Option '(?P<key>[^']+)' is not accepted"),
)
_SECTION = re.compile(r'Parser key "([^"]+)"')
_ARGUMENT = re.compile(r"argument (?:--)?(?P<option>\S+): (?P<fault>.*)")
_NO_CLASS = re.compile(r"Expected a dot import path string: (?P<name>.*)")
_EXPECTED = re.compile(r"Expected an? <class '(?P<kind>[^']+)'>")
_VALUE = re.compile(r"(?:Got|Given) value: (?P<value>.*)$", re.MULTILINE)

# Options that stand for themselves in other programs, and have a section here.
OF_OTHER_PROGRAMS = {
    "gpu": "trainer.accelerator",
    "gpus": "trainer.devices",
    "epochs": "trainer.max_epochs",
    "lr": "model.learning_rate",
}

# Kinds of values whose names do not show how they are written.
LISTS = dict.fromkeys(("list", "tuple"), "a list, such as [a,b]")

HINT = "All options: --help-all."

# Lines that only lead to the fault below them.
_HEADINGS = ("Parser key", "Does not validate", "Subtypes:", "Errors:", "Problem with", "Given ")


def known_options(parser: ArgumentParser, classes: Mapping[str, Iterable[type]]) -> set[str]:
    """Options of a parser, and those of what can be chosen in it, without their dashes.

    Args:
        parser: A subcommand's parser.
        classes: What can be chosen, by the option that chooses it.
    """
    parsers = [parser]
    for name, chosen in classes.items():
        for each in chosen:
            parsers.append(ArgumentParser())
            parsers[-1].add_class_arguments(each, name)
    return {
        ".".join(step for step in key.split(".") if step not in IMPLIED)
        for each in parsers
        for key in each.get_defaults().keys()  # noqa: SIM118
        if "__" not in key  # so begins what jsonargparse enters for itself
    }


def as_input_error(
    message: str, known: Collection[str], classes: Mapping[str, Iterable[type]]
) -> InputError:
    """One line for what the parser prints in a page.

    An option is named without its dashes: it may stand in a configuration.

    Args:
        message: The parser's.
        known: All options, without their dashes.
        classes: What can be chosen by its name alone, by the option that chooses it.
    """
    section = ".".join(_SECTION.findall(message))
    for pattern in _UNKNOWN:
        if found := pattern.search(message):
            groups = found.groupdict()
            key = ".".join(filter(None, (section, groups.get("group"), groups["key"])))
            return _unknown(key, known)
    if found := _ARGUMENT.match(message):
        return InputError(found["option"], found["fault"], HINT)
    if section in classes and (found := _NO_CLASS.search(message)):
        names = [each.__name__ for each in classes[section]]
        remedy = f"Available: {', '.join(names)}; others by module and name."
        remedy = did_you_mean(found["name"], names) + remedy
        return InputError(section, f"there is no class {found['name']}", remedy)
    return _unusable(section or "command line", message)


def _unknown(key: str, known: Collection[str]) -> InputError:
    section, dot, name = key.rpartition(".")
    renamed = f"{section}{dot}{FORMER_OPTIONS.get(name, name)}"
    likely = [renamed, OF_OTHER_PROGRAMS.get(key, "")]
    likely += sorted(option for option in known if option.endswith(f".{key}"))
    likely += difflib.get_close_matches(key, known, n=1)
    near = [option for option in likely if option in known and option != key]
    reason = "no such option"
    if key in known:  # of another network or data module
        reason = f"the chosen {key.split('.')[0]} has no such option"
    return InputError(key, reason, f"Did you mean {near[0]}?" if near else HINT)


def _unusable(subject: str, message: str) -> InputError:
    lines = [line.strip().removeprefix("- ") for line in message.splitlines()]
    faults = [line for line in lines if line and not line.startswith(_HEADINGS)]
    kinds = [found["kind"] for line in faults if (found := _EXPECTED.match(line))]
    kinds = [LISTS.get(kind, kind) for kind in dict.fromkeys(kinds) if kind != "NoneType"]
    others = list(dict.fromkeys(line for line in faults if not _EXPECTED.match(line)))
    value = _VALUE.search(message)
    if others or not (kinds and value):
        return InputError(subject, "; ".join(others or faults), HINT)
    return InputError(subject, f"cannot be {value['value']}", f"Give: {' or '.join(kinds)}.")


# What Lightning refuses options and data by. Its other errors are faults, and keep their traceback.
REFUSALS = (MisconfigurationException, ValueError, TypeError, RuntimeError)


@contextmanager
def refusals_in_a_line() -> Iterator[None]:
    """Turns what Lightning or the system refuses, before a training or in it, into one line.

    Raises:
        InputError: Lightning refused something, or a file of the run cannot be written.
    """
    try:
        yield
    except (*REFUSALS, OSError) as error:
        if isinstance(error, OSError) and error.errno is not None:  # Lightning raises others
            raise InputError(
                error.filename or "the run's folder",
                f"cannot be written ({error.strerror})",
                "Choose a folder that is writable and has room: --trainer.logger.save_dir.",
            ) from error
        if raised_by_lightning(error):
            raise InputError("--trainer", str(error).rstrip(".!"), HINT) from error
        raise


def raised_by_lightning(error: BaseException) -> bool:
    """True if Lightning itself refuses something, such as an option; its messages name it."""
    if not isinstance(error, REFUSALS):
        return False
    *_, (frame, _) = traceback.walk_tb(error.__traceback__)
    module: str = frame.f_globals.get("__name__", "")
    return module.startswith("lightning.")
