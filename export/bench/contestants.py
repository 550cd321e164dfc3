"""What a bench compares: models, filters, and the baselines that every method has to beat.

Nothing here loads torch, so that a process that measures a method's memory holds little else.
"""

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from hashlib import sha256
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError, printable
from derain.evaluation.baselines import PositionPrior, all_points, no_points
from derain.evaluation.intensity_rule import IntensityRule
from derain.export.methods import load_method, named_method
from derain.export.runtime import Derainer
from derain.filters import FilterDerainer, PointFilter
from derain.scan import Scan
from derain.system.stopwatch import Stopwatch
from derain.views.oddities import Examiner

# Judges a scan, bool (N,), and gives the stopwatch its stages.
Method = Callable[[Scan, Stopwatch], NDArray[np.bool_]]

# Gives scans and their rain, bool (N,), to whatever is learnt from them; points of which it is not
# known whether they are rain are left out.
LearnFrom = Callable[[], Iterable[tuple[Scan, NDArray[np.bool_]]]]

# The baselines that look at nothing, and those that are learnt from labelled scans.
TRIVIAL = {"all": all_points, "none": no_points}
LEARNT = ("position", "intensity")


@dataclass(frozen=True)
class Contestant:
    """One row of a bench.

    Attributes:
        title: What the row is called; no two have the same.
        kind: Name of its network, filter or baseline.
        ready: Makes the method, with a number of threads. It can be pickled: each method's cost is
            measured in a process of its own.
        facts: What the method is, for whoever repeats the bench: file or parameters.
        filter: The filter, where it is one: filters share one search for neighbours.
        judge: What it judges by, as far as a scan may not suit it.
    """

    title: str
    kind: str
    ready: Callable[[int], Method]
    facts: dict[str, Any] = field(default_factory=dict)
    filter: PointFilter | None = None
    judge: Examiner | None = None


def contestants(texts: Sequence[str], learn_from: LearnFrom | None = None) -> list[Contestant]:
    """The methods that a user names.

    Args:
        texts: Each an exported model, a YAML file of parameters, a filter or a baseline (position,
            intensity, all, none); ``title=`` before it gives it another title.
        learn_from: Scans for position and intensity; None where there are none to learn from.

    Raises:
        InputError: A method that is not known or cannot be read, one that has nothing to learn
            from, or two of one title.
    """
    rows = [_contestant(text, learn_from) for text in texts]
    titles = [row.title for row in rows]
    for title in titles:
        if titles.count(title) > 1:
            raise InputError(
                title, "two methods are called so", "Give titles, as in `first=a.onnx second=dror`."
            )
    return rows


def _contestant(text: str, learn_from: LearnFrom | None) -> Contestant:
    title, equals, name = text.partition("=")
    if not equals or os.path.isfile(text):  # files may well have an equals sign in their names
        title, name = Path(text).stem, text
    title = printable(title)  # it goes into tables and pictures
    if name in TRIVIAL:
        return Contestant(title, name, partial(_timed_rule, TRIVIAL[name]))
    if name in LEARNT:
        return _learnt(title, name, learn_from)
    return _deployable(title, *named_method(name))


def _deployable(title: str, name: str, parameters: dict[str, Any]) -> Contestant:
    """What ``derain run`` runs; made here once, so that it is refused before any work."""
    ready = partial(load_method, name, parameters)
    match ready(1):
        case FilterDerainer(filter=filter):
            return Contestant(title, name, ready, {"parameters": filter.as_dict()}, filter, filter)
        case Derainer(spec=spec):
            facts = {
                "model": name,
                "sha256": sha256(Path(name).read_bytes()).hexdigest(),
                "weights": _weights(Path(name)),
                "trained_on": spec.data,
                "threshold": spec.threshold,
            }
            return Contestant(title, spec.network, ready, facts, judge=spec)


def _weights(path: Path) -> int:
    """Numbers that an exported graph holds: weights, and in eight bits their scales."""
    import onnx  # here: it is not to be in the memory that is measured

    return sum(prod(tensor.dims) for tensor in onnx.load(path).graph.initializer)


def _learnt(title: str, name: str, learn_from: LearnFrom | None) -> Contestant:
    if learn_from is None:
        raise InputError(
            name, "it has no scans to learn from", "Give --train, or leave it out of --methods."
        )
    if name == "position":
        prior = PositionPrior.learn(learn_from())
        return Contestant(title, name, partial(_timed_rule, prior), {"voxel": prior.voxel})
    rule = IntensityRule.best(learn_from())
    limits = f"intensity <= {rule.intensity:.4g} and range <= {rule.range:.4g} m"
    return Contestant(title, name, partial(_timed_rule, rule), {"rule": limits}, judge=rule)


def _timed_rule(rule: Callable[[Scan], NDArray[np.bool_]], threads: int) -> Method:
    """A rule without a view or a network, timed as a method; it has no use for threads."""

    def judge(scan: Scan, stopwatch: Stopwatch) -> NDArray[np.bool_]:
        with stopwatch.stage("network"):
            return rule(scan)

    return judge
