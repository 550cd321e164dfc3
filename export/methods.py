"""A method by the name that a user gives it: a model, a filter, or one that sees several scans."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from derain.default import DEFAULT
from derain.errors import InputError, did_you_mean, printable
from derain.export.runtime import Derainer
from derain.export.runtimes.session import Runtime
from derain.files.documents import Entry
from derain.files.reading import is_file
from derain.filters import FILTERS, FilterDerainer, filter_from
from derain.filters.derainer import CANDIDATES
from derain.sources.method import Method
from derain.system.registry import from_parameters
from derain.views.candidates import candidates_at

PARAMETER_SUFFIXES = (".yaml", ".yml")
CHECKPOINT_SUFFIX = ".ckpt"

# The method of several scans that learns nothing.
PERSISTENCE = "persistence"

# The network whose models see the scans around each unasked; and how many before and after, as far
# as they are of its recording.
CUES = "cues"
PAST, DELAY = 1, 1


def named_method(text: str) -> tuple[str, dict[str, Any]]:
    """The method that a user names, and its parameters as far as they are given with it.

    Args:
        text: A method's name, or a YAML file of its parameters as ``derain tune`` writes it.

    Raises:
        InputError: A YAML file that is missing, or names no method.
    """
    return read_parameters(text) if Path(text).suffix in PARAMETER_SUFFIXES else (text, {})


def read_parameters(path: str | Path) -> tuple[str, dict[str, Any]]:
    """Reads the name of a method and its parameters.

    Args:
        path: A YAML file that names a ``method``, and parameters of it by name beside it.

    Returns:
        The method, and its parameters as the file has them: texts, finite numbers, true or false;
        ``candidates``, if there are any, as such.
        A model is sought from the file's own folder first, wherever the command runs; where it is
        not there, from the working folder.

    Raises:
        InputError: A missing file, one that names no method, parameters that a filter or
            persistence does not take, or candidates that are none.
    """
    path = Path(path)
    document = Entry.of_yaml(path)
    values = document.members()
    if "method" not in values:
        raise document.fault(
            "it names no method", "Write one, such as `method: dsor`, and its parameters by name."
        )
    entry = values.pop("method")
    method = entry.text()
    beside = path.parent / method
    if Path(method).suffix and not is_file(beside) and not is_file(Path(method)):
        reason = f"there is no model {beside.absolute()}"
        raise entry.fault(reason, "Put the model beside this file, or name its whole path.")
    named = str(beside) if Path(method).suffix and is_file(beside) else method
    parameters = {
        name: candidates_at(entry) if name == CANDIDATES else entry.scalar()
        for name, entry in values.items()
    }
    # Made here once, so that errors name the file; a model takes longer, and has only a threshold.
    if method != DEFAULT and not Path(method).suffix:
        try:
            load_method(method, parameters)
        except InputError as error:
            raise InputError(f"{path}: {error.subject}", error.reason, error.remedy) from error
    return named, parameters


def split_title(text: str) -> tuple[str, str]:
    """The title of a method, and its name or file.

    Args:
        text: As a user writes it: the name or the file, and before it ``title=`` or nothing.
    """
    title, equals, name = text.partition("=")
    if not equals or os.path.isfile(text):  # files may well have an equals sign in their names
        title, name = Path(text).stem, text
    return printable(title), name  # the title goes into tables and pictures


def refuse_same_titles(titles: Sequence[str]) -> None:
    """Refuses methods of which two have one title.

    Raises:
        InputError: There are such methods.
    """
    for title in titles:
        if titles.count(title) > 1:
            remedy = "Give titles, as in `first=a.onnx second=dror`."
            raise InputError(title, "it is the title of two methods", remedy)


def method_names() -> list[str]:
    """Names of methods: the model that comes with derain, filters, and persistence."""
    return [DEFAULT, *FILTERS, PERSISTENCE]


def method_hint(name: str) -> str:
    """The remedy for an unknown method, without the full stop.

    Args:
        name: What the user gave.
    """
    names = method_names()
    of_names = f"Give a model written by `derain export`, or one of {', '.join(names)}"
    return f"{did_you_mean(name, names)}{of_names}"


def is_method_name(word: str) -> bool:
    """True if a method has this name; other packages load only if none of derain's has it."""
    return word in (DEFAULT, PERSISTENCE) or word in FILTERS


def load_method(
    name: str, parameters: Mapping[str, Any], threads: int = 0, runtime: Runtime = Runtime()
) -> Method:
    """Makes a method ready to judge scans; its warnings are left to the caller.

    Args:
        name: ``default``, the model that comes with derain; a filter (one of ``FILTERS``),
            ``persistence``, or an ONNX file written by ``derain export``.
        parameters: Parameters by name: those of the filter and its ``candidates``, those of the
            method, or the ``threshold`` of the model.
        threads: Threads to use; 0 takes every core this process may use.
        runtime: What runs the model's network.

    Raises:
        InputError: No such method, a parameter that it does not have, or one out of its bounds; a
            runtime that cannot run it, or any but the usual for what has no network.
    """
    method = _loaded(name, parameters, threads, runtime)
    method.warns = False
    return method


def _loaded(name: str, parameters: Mapping[str, Any], threads: int, runtime: Runtime) -> Method:
    if name == PERSISTENCE:
        from derain.recordings.persistence import Persistence, PersistenceDerainer  # odometry

        _refuse_runtime(name, "method", runtime)
        return PersistenceDerainer(from_parameters(Persistence, name, parameters), threads)
    # What has a suffix is a file, for which other packages need not be loaded.
    if name != DEFAULT and not Path(name).suffix and name in FILTERS:
        _refuse_runtime(name, "filter", runtime)
        of_filter = {key: value for key, value in parameters.items() if key != CANDIDATES}
        return FilterDerainer(filter_from(name, of_filter), threads, parameters.get(CANDIDATES))
    if name != DEFAULT and not is_file(Path(name)):
        raise InputError(name, "no such method or file", f"{method_hint(name)}.")
    if Path(name).suffix == CHECKPOINT_SUFFIX:
        raise InputError(
            name,
            "a checkpoint, which only torch can run",
            f"Export it first: `derain export {name} --out {Path(name).with_suffix('.onnx')}`.",
        )
    derainer = Derainer(name, threads, runtime.name, runtime.precision)
    return _with_threshold(derainer, name, parameters)


def over_recording(method: Method) -> Method:
    """The method as it is best for a recording: a model of cues sees the scans around each, too.

    Args:
        method: A method that is ready to judge scans.
    """
    if not (isinstance(method, Derainer) and method.spec.network == CUES):
        return method
    from derain.export.recorded import RecordedDerainer  # a single scan needs no odometry

    return RecordedDerainer(method, PAST, DELAY)


def load_method_of_one_scan(
    name: str, parameters: Mapping[str, Any], threads: int = 0, runtime: Runtime = Runtime()
) -> Derainer | FilterDerainer:
    """Makes a method ready to judge scans one by one; arguments and errors as there.

    Raises:
        InputError: A method that sees several scans, besides: it would be measured without what it
            is meant to see.
    """
    method = load_method(name, parameters, threads, runtime)
    if not isinstance(method, Derainer | FilterDerainer):
        raise InputError(
            name,
            "sees the scans around the one that it judges, which this command does not provide",
            "Use `derain run`, or `derain teach --card`, which compares its answers with labels.",
        )
    return method


def _refuse_runtime(name: str, kind: str, runtime: Runtime) -> None:
    """Refuses to run by a runtime what has no network."""
    if not runtime.is_default:
        raise InputError(
            name, f"a {kind}, which has no network that {runtime} could run", "Leave it out."
        )


def _with_threshold(derainer: Derainer, name: str, parameters: Mapping[str, Any]) -> Derainer:
    if unknown := sorted(set(parameters) - {"threshold"}):
        raise InputError(
            name, f"it has no parameter {', '.join(unknown)}", "A model has its threshold alone."
        )
    threshold = parameters.get("threshold", derainer.spec.threshold)
    if not (isinstance(threshold, int | float) and 0 <= threshold <= 1):
        raise InputError(name, f"threshold is {threshold}", "Give a number from 0 to 1.")
    derainer.spec = replace(derainer.spec, threshold=float(threshold))
    return derainer
