"""Finds the parameters of a method that give the greatest IoU on labelled scans."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.evaluation.counts import Counts, intersection_over_union
from derain.export.storage import Storage
from derain.filters import FILTERS, PointFilter, Span, filter_from, filter_view
from derain.scan import Bools, Float32s, Scan
from derain.views.candidates import Candidates
from derain.views.neighbours import Neighbourhoods

if TYPE_CHECKING:
    import optuna


@dataclass(frozen=True, eq=False)
class LabelledNeighbourhoods:
    """The filters' view of a scan, and its truth: computed once, judged in every trial.

    Attributes:
        view: Its neighbourhoods, M points with as many neighbours as any trial looks at.
        rain: Points of rain, bool (M,).
        solid: Points of what is not rain, bool (M,). Points whose class is not known are neither.
        candidate: Points that may be called rain, bool (M,).
    """

    view: Neighbourhoods
    rain: Bools
    solid: Bools
    candidate: Bools

    @classmethod
    def of(
        cls,
        scan: Scan,
        card: DataCard,
        neighbours: int,
        threads: int,
        candidates: Candidates | None = None,
    ) -> "LabelledNeighbourhoods":
        """Finds the neighbours of a labelled scan's distinct valid positions.

        Args:
            scan: The scan.
            card: Data card of its labels.
            neighbours: How many of each point, the point itself included; see
                :func:`neighbours_to_find`.
            threads: Threads of the search; 0 takes every core this process may use.
            candidates: Bounds outside which nothing is called rain; None where anything may be.

        Raises:
            InputError: A scan without labels.
        """
        view = filter_view(neighbours, threads)(scan)
        rain, unknown = card.rain_of(scan)[view.first], card.unknown_of(scan)[view.first]
        among = np.ones(len(scan), bool) if candidates is None else candidates.among(scan)
        return cls(view, rain, ~(rain | unknown), among[view.first])


@dataclass(frozen=True)
class Tuned:
    """The result of tuning.

    Attributes:
        parameters: The parameters of the greatest IoU, by name.
        iou: IoU of rain with them, over the points of all scans together.
        default_iou: The same with the parameters that the method has by default.
    """

    parameters: Mapping[str, Any]
    iou: float
    default_iou: float


def search_space(name: str) -> Mapping[str, Span]:
    """The spans that the parameters of a filter are searched in.

    Args:
        name: One of ``FILTERS``.

    Raises:
        InputError: A filter without spans, which cannot be tuned, or with a span of no parameter,
            or one that leaves out the default, from which a search starts.
    """
    space = FILTERS[name].SPACE
    if not space:
        raise InputError(
            name, "it cannot be tuned, because it has no spans to search", "Give its class a SPACE."
        )
    default = filter_from(name, {}).as_dict()
    for parameter, (low, high) in space.items():
        if parameter not in default or not low <= default[parameter] <= high:
            reason = f"its SPACE has {parameter} from {low} to {high}, where its default is "
            reason += str(default.get(parameter, "missing"))
            raise InputError(name, reason, "Correct the SPACE of its class.")
    return space


def neighbours_to_find(name: str) -> int:
    """The most neighbours of a point that a search for a filter's parameters needs.

    Args:
        name: One of ``FILTERS``.

    Raises:
        InputError: A filter that cannot be tuned.
    """
    default = filter_from(name, {}).neighbours
    _, most = search_space(name).get("neighbours", (default, default))
    return max(default, int(most))


def tune_filter(
    name: str,
    scans: Mapping[str, LabelledNeighbourhoods],
    trials: int,
    seed: int = 0,
    storage: Storage | None = None,
    after_trial: Callable[[], object] = lambda: None,
) -> Tuned:
    """Tunes a filter with Optuna's tree-structured Parzen estimator.

    The first trial is that of the filter's default parameters. A search may be broken off, even in
    the midst of a trial, and started again: it then comes to the result that it would have come to.
    Several searches of one storage share the trials; with the values that others compute meanwhile
    they draw other trials than one search alone. Each ends once there are enough; the others may
    then be at work on one more each, and find better parameters.

    Args:
        name: One of ``FILTERS``.
        scans: Scans with rain in them, by their names, with as many neighbours as
            :func:`neighbours_to_find`. The trials in a storage count only for the same scans,
            labelled alike.
        trials: Trials in all, those that the storage holds already included.
        seed: Random seed of the sampler, which draws the parameters of each trial.
        storage: Storage of the trials, so that a later search goes on from them, and one at the
            same time shares them; None keeps nothing.
        after_trial: Called after each trial.

    Raises:
        InputError: A filter that cannot be tuned; a storage that cannot be used, or holds trials on
            other scans or labels.

    Source: J. Bergstra et al., "Algorithms for Hyper-Parameter Optimization", NeurIPS 2011; 100
        scans and 100 trials as in the REHEARSE-3D paper.
    """
    import optuna
    from optuna.trial import TrialState
    from sqlalchemy.exc import SQLAlchemyError

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    default = filter_from(name, {})
    kept = None if storage is None else storage.open()  # in memory where none is to be kept
    labelled = list(scans.values())
    try:
        study = optuna.create_study(
            storage=kept, study_name=name, direction="maximize", load_if_exists=True
        )
        _agree_on_data(study, name, scans, storage)
        _begin(study, default)
        while len(_trials(study, TrialState.COMPLETE)) < trials:
            trial = _drawn(study, name, seed)
            iou = pooled_iou(filter_from(name, trial.params), labelled)
            with suppress(RuntimeError):  # see _begin
                study.tell(trial, iou, skip_if_finished=True)
            after_trial()
        best = max(_trials(study, TrialState.COMPLETE), key=lambda trial: trial.values[0])
    except BrokenPipeError:  # the pipe that after_trial prints to, not the storage
        raise
    except (optuna.exceptions.OptunaError, SQLAlchemyError, OSError) as error:
        if storage is None:
            raise
        raise storage.refused(error) from error
    parameters = filter_from(name, best.params).as_dict()
    return Tuned(parameters, best.values[0], pooled_iou(default, labelled))


def tune_threshold(judged: Iterable[tuple[Float32s, Bools]], threshold: float) -> Tuned:
    """Finds the best threshold of a model, exactly.

    Between two neighbouring probabilities all thresholds decide alike, so that one for each gap
    stands for all that there are; the IoU of each is computed.

    Args:
        judged: Probabilities of rain of the points of each scan, float32 (N,), and which are rain,
            bool (N,).
        threshold: The model's own, for comparison.
    """
    probabilities, rains = zip(*judged, strict=True)
    probability = np.concatenate(probabilities)
    rain = np.concatenate(rains)
    order = np.argsort(-probability, kind="stable")
    falling, hits = probability[order], np.cumsum(rain[order])
    called = np.arange(1, len(falling) + 1)
    # Row i is what calls the i + 1 most probable points rain. Points of one probability are called
    # rain together, so that only the row of the last of them is a choice. A point is rain where its
    # probability is greater than the threshold, which is 0 at least: of probability 0 none is.
    last = np.append(falling[1:] < falling[:-1], True) & (falling > 0)
    errors = rain.sum() - hits + called - hits
    iou = np.where(last, intersection_over_union(hits, errors), 0.0)
    best = int(np.argmax(iou))
    following = falling[best + 1] if best + 1 < len(falling) else np.float32(0)
    # Midway between the last probability that is called rain and the next one, so that a rounding
    # of the last digit decides nothing; the next one itself where no number lies between them.
    middle = (falling[best] + following) / 2
    chosen = middle if middle < falling[best] else following
    default = Counts.of(probability > threshold, rain).iou
    return Tuned({"threshold": float(chosen)}, float(iou[best]), default)


def pooled_iou(filter: PointFilter, scans: Sequence[LabelledNeighbourhoods]) -> float:
    """IoU of rain over the points of all scans; NaN where there is none and none is found."""
    total = Counts()
    for scan in scans:
        known = scan.rain | scan.solid
        called = filter.judge(scan.view) & scan.candidate
        total += Counts.of(called[known], scan.rain[known])
    return total.iou


def _agree_on_data(
    study: "optuna.Study",
    name: str,
    scans: Mapping[str, LabelledNeighbourhoods],
    storage: Storage | None,
) -> None:
    """Writes into a study what its trials are computed on, or compares what is there.

    Raises:
        InputError: The study is of other scans, labels, spans or candidates.
    """
    facts: dict[str, Any] = {
        "scans": list(scans),
        "rain_and_solid": [[int(s.rain.sum()), int(s.solid.sum())] for s in scans.values()],
        "bounds": {k: list(v) for k, v in search_space(name).items()},
    }
    if not all(s.candidate.all() for s in scans.values()):
        facts["candidates"] = [int(s.candidate.sum()) for s in scans.values()]
    if study.trials and study.user_attrs != facts:
        raise InputError(
            str(storage),
            f"holds a study of {name} on other scans, labels or candidates",
            "Name another --storage.",
        )
    for key, fact in facts.items():
        study.set_user_attr(key, fact)


def _trials(
    study: "optuna.Study", *states: "optuna.trial.TrialState"
) -> "list[optuna.trial.FrozenTrial]":
    return study.get_trials(deepcopy=False, states=states)


def _begin(study: "optuna.Study", default: PointFilter) -> None:
    """Gives up the trials that were left, and has the filter's own parameters tried first.

    A search that was killed left a trial running. One that is at work looks the same: it computes
    its trial in vain, once, and goes on.
    """
    from optuna.trial import TrialState

    for left in _trials(study, TrialState.RUNNING):
        with suppress(RuntimeError):  # it ended just now
            study.tell(left.number, state=TrialState.FAIL, skip_if_finished=True)
    if not _trials(study, TrialState.COMPLETE, TrialState.WAITING):
        study.enqueue_trial({parameter: getattr(default, parameter) for parameter in default.SPACE})


def _drawn(study: "optuna.Study", name: str, seed: int) -> "optuna.Trial":
    """A new trial, whose parameters depend on the seed and on the trials before it.

    How many these are is added to the seed, so that a search goes on as one that was never broken
    off, and searches at the same time draw different trials, unless one has just begun.
    """
    from optuna.samplers import TPESampler
    from optuna.trial import TrialState

    trial = study.ask()
    others = _trials(study, TrialState.COMPLETE, TrialState.RUNNING)
    before = sum(other.number < trial.number for other in others)
    study.sampler = TPESampler(seed=(seed + before) % 2**32)  # it takes no larger ones
    with suppress(RuntimeError):  # see _begin
        for parameter, (low, high) in search_space(name).items():
            if isinstance(low, int) and isinstance(high, int):
                trial.suggest_int(parameter, low, high)
            else:
                trial.suggest_float(parameter, low, high, log=True)
    return trial
