"""Tuning finds what is there to be found, and goes on where it stopped."""

import itertools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import optuna
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export import tuning
from derain.export.tuning import (
    SPACES,
    Search,
    ViewedScan,
    pooled_iou,
    tune_filter,
    tune_threshold,
)
from derain.filters import FILTERS, FilterDerainer, filter_from
from derain.scan import Scan

CARD = DataCard("made up", {0: "solid", 3: "rain", 9: "unknown"}, rain=(3,), unknown=(9,))


def labelled(seed: int) -> Scan:
    label = np.where(np.arange(600) >= 540, 3, 0)
    label[:50] = 9
    return Scan.of(scene(600, seed)).with_label(label)


@pytest.fixture(scope="module")
def viewed() -> list[ViewedScan]:
    return [ViewedScan.of(labelled(seed), CARD, threads=1) for seed in (1, 2)]


def search(trials: int, storage: Path | None = None, data: str = "a") -> tuple[Search, list[int]]:
    told: list[int] = []
    return Search(trials, 0, storage, [data], lambda: told.append(1)), told


@pytest.mark.parametrize("name", FILTERS)
def test_a_trial_scores_a_filter_as_running_it_does(name: str, viewed: list[ViewedScan]) -> None:
    filter = filter_from(name, {})
    found = union = 0
    for seed in (1, 2):
        scan = labelled(seed)
        called, known = FilterDerainer(filter, 1)(scan), scan.label != 9
        found += np.count_nonzero(called & (scan.label == 3))
        union += np.count_nonzero((called | (scan.label == 3)) & known)
    assert pooled_iou(filter, viewed) == found / union


@pytest.mark.parametrize("name", FILTERS)
def test_tuning_starts_from_the_defaults_and_ends_no_worse(
    name: str, viewed: list[ViewedScan]
) -> None:
    for trials in (1, 12):
        how, told = search(trials)
        tuned = tune_filter(name, viewed, how)
        assert len(told) == trials
        assert tuned.iou == pooled_iou(filter_from(name, tuned.parameters), viewed)
        assert tuned.default_iou == pooled_iou(filter_from(name, {}), viewed)
        assert tuned.iou >= tuned.default_iou
        if trials == 1:
            assert filter_from(name, tuned.parameters) == filter_from(name, {})


def test_every_filter_has_bounds_that_hold_its_defaults() -> None:
    assert list(SPACES) == list(FILTERS)
    for name, space in SPACES.items():
        default = filter_from(name, {}).as_dict()
        assert all(low <= default[parameter] <= high for parameter, (low, high) in space.items())


def test_tuning_finds_the_radius_that_parts_drops_from_a_wall() -> None:
    # A wall of points 0.1 m apart, and drops 2 m apart before it: any radius between parts them.
    y, z = np.meshgrid(np.arange(-3, 3, 0.1), np.arange(-3, 3, 0.1))
    wall = np.stack([np.full(y.size, 20.0), y.ravel(), z.ravel()], axis=1)
    drops = np.stack(np.meshgrid([4.0, 6, 8], [-4.0, -2, 0, 2, 4], [0.0, 2])).reshape(3, -1).T
    points = np.concatenate([wall, drops]).astype(np.float32)
    label = np.where(np.arange(len(points)) >= len(wall), 3, 0)
    viewed = [ViewedScan.of(Scan(points).with_label(label), CARD, threads=1)]
    tuned = tune_filter("ror", viewed, search(60)[0])
    assert tuned.iou == 1 > tuned.default_iou
    assert 0.1 < tuned.parameters["radius"] < 3


def test_one_seed_finds_one_answer(viewed: list[ViewedScan]) -> None:
    assert tune_filter("dsor", viewed, search(15)[0]) == tune_filter("dsor", viewed, search(15)[0])


def test_a_stored_study_goes_on_to_the_number_of_trials(
    viewed: list[ViewedScan], tmp_path: Path
) -> None:
    storage = tmp_path / "study.db"
    for trials, run in ((4, 4), (9, 5), (9, 0)):
        how, told = search(trials, storage)
        tuned = tune_filter("dsor", viewed, how)
        assert len(told) == run
    again = tune_filter("dsor", viewed, search(9, storage)[0])
    assert again == tuned
    with pytest.raises(InputError, match="holds a study of dsor on other scans"):
        tune_filter("dsor", viewed, search(9, storage, data="b")[0])
    # Another filter has a study of its own in the same file.
    assert tune_filter("ror", viewed, search(1, storage, data="b")[0]).iou > 0


def test_a_study_goes_on_only_with_the_same_labels(
    viewed: list[ViewedScan], tmp_path: Path
) -> None:
    storage = tmp_path / "study.db"
    tune_filter("dsor", viewed, search(1, storage)[0])
    other = DataCard("made up", {0: "solid", 3: "rain", 9: "also rain"}, rain=(3, 9))
    relabelled = [ViewedScan.of(labelled(seed), other, threads=1) for seed in (1, 2)]
    with pytest.raises(InputError, match="other scans or labels"):
        tune_filter("dsor", relabelled, search(2, storage)[0])


def trials_in(storage: Path) -> list[tuple[dict[str, float], float]]:
    """Parameters and values of the trials of DSOR's study, all of which are complete."""
    study = optuna.load_study(study_name="dsor", storage=f"sqlite:///{storage}")
    assert all(trial.state == optuna.trial.TrialState.COMPLETE for trial in study.trials)
    return [(trial.params, trial.value) for trial in study.trials]


def test_a_search_broken_off_in_the_midst_of_a_trial_ends_as_an_unbroken_one(
    viewed: list[ViewedScan], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    unbroken = tune_filter("dsor", viewed, search(14, tmp_path / "unbroken.db")[0])
    for whole in (0, 12):  # none, and more than are drawn at random
        storage = tmp_path / f"{whole}.db"
        weighed = itertools.count()

        def broken_off(*arguments: Any, whole: int = whole, weighed: Any = weighed) -> float:
            if next(weighed) == whole:
                raise KeyboardInterrupt
            return pooled_iou(*arguments)

        with monkeypatch.context() as patch:
            patch.setattr(tuning, "pooled_iou", broken_off)
            with pytest.raises(KeyboardInterrupt):
                tune_filter("dsor", viewed, search(14, storage)[0])
        assert len(trials_in(storage)) == whole
        assert tune_filter("dsor", viewed, search(14, storage)[0]) == unbroken
        assert trials_in(storage) == trials_in(tmp_path / "unbroken.db")


def test_a_running_trial_that_nobody_runs_is_no_trial(
    viewed: list[ViewedScan], tmp_path: Path
) -> None:
    storage = tmp_path / "study.db"
    tune_filter("dsor", viewed, search(5, storage)[0])
    optuna.load_study(study_name="dsor", storage=f"sqlite:///{storage}").ask()
    assert tune_filter("dsor", viewed, search(14, storage)[0]) == (
        tune_filter("dsor", viewed, search(14)[0])
    )


def test_trials_of_another_seed_count(viewed: list[ViewedScan], tmp_path: Path) -> None:
    storage = tmp_path / "study.db"
    first = replace(search(12, storage)[0], seed=7)
    best = tune_filter("dsor", viewed, first)
    how, told = search(12, storage)
    assert tune_filter("dsor", viewed, how) == best
    assert told == []
    assert tune_filter("dsor", viewed, search(20, storage)[0]).iou >= best.iou
    assert len(trials_in(storage)) == 20


@pytest.mark.parametrize("make", [Path.mkdir, lambda path: path.write_text("no database" * 99)])
def test_a_storage_that_cannot_be_used_is_refused(
    make: Callable[[Path], object], viewed: list[ViewedScan], tmp_path: Path
) -> None:
    storage = tmp_path / "study.db"
    make(storage)
    with pytest.raises(InputError, match="cannot be used as storage"):
        tune_filter("dsor", viewed, search(1, storage)[0])


# Two of them are neighbours: nothing lies midway.
PROBABILITIES = np.array([0, 0.1, np.nextafter(np.float32(0.1), 1), 0.5, 1], np.float32).tolist()

judged = st.integers(1, 30).flatmap(
    lambda points: st.tuples(
        arrays.arrays(np.float32, points, elements=st.sampled_from(PROBABILITIES)),
        arrays.arrays(bool, points),
    )
)


@given(st.lists(judged, min_size=1, max_size=3).filter(lambda s: any(r.any() for _, r in s)))
def test_the_best_threshold_is_that_of_trying_all(
    scans: list[tuple[np.ndarray, np.ndarray]],
) -> None:
    probability = np.concatenate([p for p, _ in scans])
    rain = np.concatenate([r for _, r in scans])

    def iou(threshold: float) -> float:
        called = probability > threshold
        return np.count_nonzero(called & rain) / np.count_nonzero(called | rain)

    tuned = tune_threshold(scans, 0.5)
    assert 0 <= tuned.parameters["threshold"] <= 1
    assert iou(tuned.parameters["threshold"]) == tuned.iou == max(map(iou, [0, *probability]))
    assert tuned.default_iou == iou(0.5)
