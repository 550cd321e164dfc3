"""Finds the parameters of a method that give the greatest IoU on labelled scans."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.evaluation.counts import Counts, intersection_over_union
from derain.filters import PointFilter, filter_from
from derain.filters.derainer import filter_view
from derain.scan import Scan
from derain.views.neighbours import Neighbourhoods

if TYPE_CHECKING:
    import optuna

MOST_NEIGHBOURS = 12

Bounds = tuple[int, int] | tuple[float, float]

# Where each parameter is looked for; the others stay as they are by default. Whole numbers are
# drawn evenly, all else evenly in its logarithm: what fits one sensor may be a tenth of what fits
# another. Of DROR's multiplier and resolution only the product counts.
SPACES: dict[str, dict[str, Bounds]] = {
    "ror": {"neighbours": (2, MOST_NEIGHBOURS), "radius": (0.01, 3.0)},
    "sor": {"neighbours": (2, MOST_NEIGHBOURS), "deviation_multiplier": (0.001, 10.0)},
    "dror": {
        "neighbours": (2, MOST_NEIGHBOURS),
        "radius_multiplier": (0.3, 30.0),
        "minimum_radius": (0.005, 1.0),
    },
    "dsor": {
        "neighbours": (2, MOST_NEIGHBOURS),
        "deviation_multiplier": (0.001, 10.0),
        "range_multiplier": (0.002, 2.0),
    },
    "ssr": {"neighbours": (2, MOST_NEIGHBOURS), "threshold": (0.01, 1e6)},
}


@dataclass(frozen=True)
class Tuned:
    """What tuning found.

    Attributes:
        parameters: The best parameters by name.
        iou: IoU of rain with them, over the points of all scans.
        default_iou: That with the method's own.
    """

    parameters: Mapping[str, Any]
    iou: float
    default_iou: float


@dataclass(frozen=True, eq=False)
class ViewedScan:
    """A scan as filters see it: computed once, judged in every trial.

    Attributes:
        view: Its neighbourhoods, as wide as any trial looks.
        rain: Points of rain, bool (M,).
        solid: Points of what is not rain, bool (M,); those not known are neither.
    """

    view: Neighbourhoods
    rain: NDArray[np.bool_]
    solid: NDArray[np.bool_]

    @classmethod
    def of(cls, scan: Scan, card: DataCard, threads: int) -> "ViewedScan":
        """Views a labelled scan, with its distinct valid positions for points.

        Raises:
            InputError: A scan without labels.
        """
        view = filter_view(MOST_NEIGHBOURS, threads)(scan)
        rain, unknown = card.rain_of(scan)[view.first], card.unknown_of(scan)[view.first]
        return cls(view, rain, ~(rain | unknown))


@dataclass(frozen=True)
class Search:
    """How the best parameters are looked for.

    Attributes:
        trials: Trials in all, those of an earlier run included.
        seed: Of the sampler.
        storage: SQLite file that keeps the study; None forgets it.
        data: Names of the scans: a study goes on only with the same ones, labelled alike.
        done: Called after each trial.
    """

    trials: int
    seed: int
    storage: Path | None
    data: Sequence[str]
    done: Callable[[], object]


def tune_filter(name: str, scans: Sequence[ViewedScan], search: Search) -> Tuned:
    """Tunes a filter with Optuna's tree-structured Parzen estimator.

    The first trial is that of the filter's default parameters. A search that was broken off, in
    the midst of a trial even, goes on as if it had not been: the sampler draws all trials anew,
    and those that the storage holds are not weighed again.

    Args:
        name: One of ``SPACES``.
        scans: Scans with rain in them.
        search: How to search.

    Raises:
        InputError: A storage that cannot be used, or holds a study of other scans or labels.

    Source: J. Bergstra et al., "Algorithms for Hyper-Parameter Optimization", NeurIPS 2011; 100
        scans and 100 trials as in the REHEARSE-3D paper.
    """
    import optuna
    from sqlalchemy.exc import SQLAlchemyError

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    default = filter_from(name, {})

    def objective(parameters: Mapping[str, Any]) -> float:
        return pooled_iou(filter_from(name, parameters), scans)

    # What is stored is never less than a whole trial, whenever the process is killed.
    study = optuna.create_study(
        direction="maximize", sampler=optuna.samplers.TPESampler(seed=search.seed)
    )
    study.enqueue_trial({key: getattr(default, key) for key in SPACES[name]})
    try:
        stored = _stored(name, scans, search)
        known = stored.get_trials(states=[optuna.trial.TrialState.COMPLETE])
        for number in range(max(search.trials, len(known))):
            if number < len(known):
                _repeat(study, known[number])
            else:
                trial = study.ask(_distributions(SPACES[name]))
                study.tell(trial, objective(trial.params))
                stored.add_trial(study.trials[-1])
                search.done()
    except (optuna.exceptions.OptunaError, SQLAlchemyError) as error:
        raise _unusable(search.storage, error) from error
    best = filter_from(name, study.best_params)
    return Tuned(best.as_dict(), study.best_value, pooled_iou(default, scans))


def tune_threshold(
    judged: Iterable[tuple[NDArray[np.float32], NDArray[np.bool_]]], threshold: float
) -> Tuned:
    """Finds the best threshold of a model, exactly: every one that decides differently is weighed.

    Args:
        judged: Probabilities of rain of the points of each scan, float32 (N,), and which are rain.
        threshold: The model's own.
    """
    probabilities, rains = zip(*judged, strict=True)
    probability = np.concatenate(probabilities)
    rain = np.concatenate(rains)
    order = np.argsort(-probability, kind="stable")
    falling, hits = probability[order], np.cumsum(rain[order])
    called = np.arange(1, len(falling) + 1)
    # Points of one probability are called alike: only the last of them ends a choice. No threshold
    # is below 0, so that points of probability 0 are never called.
    last = np.append(falling[1:] < falling[:-1], True) & (falling > 0)
    errors = rain.sum() - hits + called - hits
    iou = np.where(last, intersection_over_union(hits, errors), 0.0)
    best = int(np.argmax(iou))
    following = falling[best + 1] if best + 1 < len(falling) else np.float32(0)
    # Midway, so that a rounding of the last digit decides nothing, where there is a midway.
    middle = (falling[best] + following) / 2
    chosen = middle if middle < falling[best] else following
    default = Counts.of(probability > threshold, rain).iou
    return Tuned({"threshold": float(chosen)}, float(iou[best]), default)


def pooled_iou(filter: PointFilter, scans: Sequence[ViewedScan]) -> float:
    """IoU of rain over the points of all scans; 1 where there is none and none is found."""
    total = Counts()
    for scan in scans:
        known = scan.rain | scan.solid
        total += Counts.of(filter.judge(scan.view)[known], scan.rain[known])
    return total.iou


def _stored(name: str, scans: Sequence[ViewedScan], search: Search) -> "optuna.Study":
    """The study that keeps the trials: a new one, or that of the same filter in the storage."""
    import optuna

    study = optuna.create_study(
        storage=None if search.storage is None else f"sqlite:///{search.storage}",
        study_name=name,
        direction="maximize",
        load_if_exists=True,
    )
    facts = {
        "scans": list(search.data),
        "rain_and_solid": [[int(s.rain.sum()), int(s.solid.sum())] for s in scans],
        "bounds": {k: list(v) for k, v in SPACES[name].items()},
    }
    if study.trials and study.user_attrs != facts:
        raise InputError(
            str(search.storage),
            f"holds a study of {name} on other scans or labels",
            "Name another --storage.",
        )
    for key, fact in facts.items():
        study.set_user_attr(key, fact)
    return study


def _repeat(study: "optuna.Study", known: "optuna.trial.FrozenTrial") -> None:
    """Draws a trial whose value is known, so that the sampler comes to where it was."""
    import optuna

    trial = study.ask(known.distributions)
    if trial.params == known.params:
        study.tell(trial, known.value)
    else:  # drawn by another seed
        study.tell(trial, state=optuna.trial.TrialState.FAIL)
        study.add_trial(known)


def _distributions(
    space: Mapping[str, Bounds],
) -> "dict[str, optuna.distributions.BaseDistribution]":
    from optuna.distributions import FloatDistribution, IntDistribution

    return {
        name: IntDistribution(low, high)
        if isinstance(low, int) and isinstance(high, int)
        else FloatDistribution(low, high, log=True)
        for name, (low, high) in space.items()
    }


def _unusable(storage: Path | None, error: Exception) -> InputError:
    # What SQLAlchemy says goes on for lines, with the statement and a link.
    reason = str(error).splitlines()[0]
    return InputError(
        str(storage),
        f"cannot be used as storage ({reason})",
        "Name a new file that can be written.",
    )
