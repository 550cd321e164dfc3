"""The entries of a bench: models, filters, and the baselines that every method has to beat.

Nothing here loads torch, so that a process that measures a method's memory holds little else.
"""

import json
import pickle
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from derain.errors import InputError, printable
from derain.evaluation.baselines import VOXEL, IntensityRule, PositionPrior, all_points, no_points
from derain.export.methods import (
    load_method_of_one_scan,
    named_method,
    refuse_same_titles,
    split_title,
)
from derain.export.model_file import number_of_weights
from derain.export.runtime import Derainer
from derain.export.runtimes.session import Runtime
from derain.filters import FilterDerainer, PointFilter
from derain.filters.derainer import CANDIDATES
from derain.scan import Array, Bools, Scan
from derain.spec import Spec
from derain.system.stopwatch import Stopwatch

# Returns which points of a scan are rain, bool (N,). Takes the scan, and a stopwatch for its stages
# where they are to be timed.
TimedMethod = Callable[..., Bools]

# Name of the fact that holds the bytes of a method's file.
FILE_SIZE = "file_bytes"

# A method as a user gives it: a name or a file, a derainer, a filter, or a function from a scan to
# which of its points are rain, bool (N,).
GivenMethod = str | Path | Derainer | FilterDerainer | PointFilter | Callable[[Scan], Array]

# Returns scans without points of unknown class, and their rain, bool (N,), for baselines to learn
# from.
LearnFrom = Callable[[], Iterable[tuple[Scan, Bools]]]

# The baselines that ignore the scan, and those that learn from labelled scans.
TRIVIAL = {"all": all_points, "none": no_points}
LEARNT = ("position", "intensity")


@dataclass(frozen=True)
class BenchEntry:
    """One row of a bench.

    Attributes:
        title: Its title; no two have the same.
        kind: Name of its network, filter or baseline.
        ready: Makes the method, with a number of threads.
        facts: File or parameters, from which the bench can be repeated.
        filter: The filter, where it is one: filters share one search for neighbours.
        spec_or_filter: Checks whether a scan suits the method: a model's Spec, a filter or a rule.
        runtime: The runtime of a model.
        learnt: Fingerprint of what a baseline has learnt, where its facts do not hold it.
    """

    title: str
    kind: str
    ready: Callable[[int], TimedMethod]
    facts: dict[str, Any] = field(default_factory=dict)
    filter: FilterDerainer | None = None
    spec_or_filter: Spec | PointFilter | IntensityRule | None = None
    runtime: Runtime = field(default_factory=Runtime)
    learnt: str = ""

    @property
    def fingerprint(self) -> str:
        """A fingerprint of what it calls rain, 16 hexadecimal digits, wherever its file lies."""
        facts = {name: fact for name, fact in self.facts.items() if name != "model"}
        content = json.dumps([self.kind, facts, self.learnt], sort_keys=True)
        return sha256(content.encode()).hexdigest()[:16]

    @cached_property
    def is_picklable(self) -> bool:
        """True if it can be sent to another process.

        Objects that cannot be pickled cannot, nor can those that the user's own script or session
        defines, which no other process can import.
        """
        try:
            return b"__main__" not in pickle.dumps(self.ready)
        except Exception:  # objects that cannot be pickled raise errors of many types
            return False


def bench_entries(
    methods: str | Path | Sequence[GivenMethod] | Mapping[str, GivenMethod],
    learn_from: LearnFrom | None = None,
    runtime: Runtime = Runtime(),
) -> list[BenchEntry]:
    """The methods of a bench.

    Args:
        methods: The methods, by their titles or with titles of their own; or one text. A text is
            ``default``, an exported model, a YAML file of parameters, a filter or a baseline
            (position, intensity, all, none), and without a mapping may have ``title=`` before it.
        learn_from: Scans for position and intensity; None where there are none to learn from.
        runtime: A second runtime for every model, besides onnxruntime.

    Raises:
        InputError: No method; one that is not known or cannot be read, or has nothing to learn
            from; two of one title; or a runtime that cannot run the models, or has none to run.
    """
    if isinstance(methods, str | Path):
        methods = [methods]
    if not methods:
        raise InputError("methods", "there are none", "Give one or more.")
    if isinstance(methods, Mapping):
        rows = [
            replace(_bench_entry(method, learn_from), title=printable(title))
            for title, method in methods.items()
        ]
    else:
        rows = [_bench_entry(method, learn_from) for method in methods]
    rows = _with_runtime_variants(rows, runtime)
    refuse_same_titles([row.title for row in rows])
    return rows


def _with_runtime_variants(rows: Sequence[BenchEntry], runtime: Runtime) -> list[BenchEntry]:
    """The methods, each model followed by the same in another runtime.

    Args:
        rows: The methods.
        runtime: The other runtime; the default one adds nothing.

    Raises:
        InputError: A runtime that cannot run one of the models, or no model.
    """
    if runtime.is_default:
        return list(rows)
    beside = []
    for row in rows:
        beside.append(row)
        if isinstance(row.spec_or_filter, Spec) and row.runtime.is_default:
            beside.append(replace(_with_runtime(row, runtime), title=f"{row.title} ({runtime})"))
    if len(beside) == len(rows):
        raise InputError(f"runtime {runtime}", "none of the methods is a model", "Leave it out.")
    return beside


def _with_runtime(row: BenchEntry, runtime: Runtime) -> BenchEntry:
    """A model in another runtime.

    Raises:
        InputError: A runtime that cannot run the model.
    """
    make: Callable[..., TimedMethod] = row.ready  # a model's takes a runtime
    ready = partial(make, runtime=runtime)
    ready(1)  # refused before any work
    facts = {**row.facts, "runtime": str(runtime)}  # one text, because precision is also a score
    return replace(row, ready=ready, facts=facts, runtime=runtime)


def _bench_entry(method: GivenMethod, learn_from: LearnFrom | None) -> BenchEntry:
    match method:
        case str():
            return _named(method, learn_from)
        case Path():
            return _deployable(printable(method.stem), *named_method(str(method)))
        case PointFilter():
            return _filter(method.name, FilterDerainer(method))
        case FilterDerainer():
            return _filter(method.filter.name, method)
        case Derainer(name=name, spec=spec):
            known = {"threshold": spec.threshold}
            ready = partial(load_method_of_one_scan, name, known)
            row = _model(printable(Path(name).stem), name, method, ready)
            return row if method.runtime.is_default else _with_runtime(row, method.runtime)
        case _ if callable(method) and not isinstance(method, type):
            title = printable(getattr(method, "__name__", type(method).__name__))
            return BenchEntry(title, "function", TimedFunction(method).ready)
    raise InputError(
        "methods",
        f"{method!r} is no method",
        "Give a name, a file, a derainer, a filter, or a function of a scan.",
    )


def _named(text: str, learn_from: LearnFrom | None) -> BenchEntry:
    title, name = split_title(text)
    if name in TRIVIAL:
        return BenchEntry(title, name, TimedFunction(TRIVIAL[name]).ready)
    if name in LEARNT:
        return _learnt(title, name, learn_from)
    return _deployable(title, *named_method(name))


def _deployable(title: str, name: str, parameters: dict[str, Any]) -> BenchEntry:
    """A method of ``derain run``; made here once, so that errors come before any work."""
    ready = partial(load_method_of_one_scan, name, parameters)
    match ready(1):
        case FilterDerainer() as derainer:
            return _filter(title, derainer)
        case Derainer() as derainer:
            return _model(title, name, derainer, ready)


def _filter(title: str, derainer: FilterDerainer) -> BenchEntry:
    filter = derainer.filter
    facts: dict[str, Any] = {"parameters": filter.as_dict()}
    if derainer.candidates is not None:
        facts[CANDIDATES] = str(derainer.candidates)
    ready = partial(_ready_filter, derainer)
    return BenchEntry(title, filter.name, ready, facts, derainer, spec_or_filter=filter)


def _ready_filter(derainer: FilterDerainer, threads: int) -> FilterDerainer:
    ready = FilterDerainer(derainer.filter, threads, derainer.candidates)
    ready.warns = False  # a bench itself prints what is odd
    return ready


def _model(
    title: str, name: str, derainer: Derainer, ready: Callable[[int], FilterDerainer | Derainer]
) -> BenchEntry:
    spec, content = derainer.spec, derainer.path.read_bytes()
    facts = {
        "model": name,
        "sha256": sha256(content).hexdigest(),
        FILE_SIZE: len(content),
        "weights": number_of_weights(content),
        "trained_on": spec.data,
        "threshold": spec.threshold,
    }
    return BenchEntry(title, spec.network, ready, facts, spec_or_filter=spec)


def _learnt(title: str, name: str, learn_from: LearnFrom | None) -> BenchEntry:
    if learn_from is None:
        raise InputError(
            name, "it has no scans to learn from", "Give --train, or leave it out of --methods."
        )
    if name == "position":
        prior = PositionPrior.learn(learn_from())
        learnt = sha256(prior.rain.tobytes()).hexdigest()
        return BenchEntry(title, name, TimedFunction(prior).ready, {"voxel": VOXEL}, learnt=learnt)
    rule = IntensityRule.best(learn_from())
    limits = f"intensity <= {rule.intensity:.4g} and range <= {rule.range:.4g} m"
    learnt = repr((float(rule.intensity), float(rule.range)))  # not rounded, as the facts are
    ready = TimedFunction(rule).ready
    return BenchEntry(title, name, ready, {"rule": limits}, spec_or_filter=rule, learnt=learnt)


@dataclass(frozen=True)
class TimedFunction:
    """A function without a view or a network of its own, timed as one stage.

    Attributes:
        function: Returns which points of a scan are rain, bool (N,).
    """

    function: Callable[[Scan], Array]

    def ready(self, threads: int) -> "TimedFunction":
        """The method itself; a bench does not control the threads of a function."""
        return self

    def __call__(self, scan: Scan, stopwatch: Stopwatch | None = None) -> Bools:
        """True for points that are rain, bool (N,).

        Raises:
            InputError: The function returns anything but one bool for each point.
        """
        with (stopwatch or Stopwatch()).stage("network"):
            rain = np.asarray(self.function(scan))
        if rain.shape != (len(scan),) or rain.dtype != bool:
            raise InputError(
                scan.name,
                f"the method gives {rain.dtype} of shape {rain.shape} for {len(scan):,} points",
                "Let it return a bool array of shape (N,), True for rain.",
            )
        return rain
