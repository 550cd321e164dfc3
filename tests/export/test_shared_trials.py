"""Searches that share a storage compute each trial once, and find the same."""

from typing import Any

import optuna
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from optuna.distributions import FloatDistribution
from optuna.storages import BaseStorage, InMemoryStorage
from optuna.trial import FrozenTrial, TrialState

from derain.export.shared_trials import SharedTrials

SPACE = {"x": FloatDistribution(-3, 3), "y": FloatDistribution(1, 100, log=True)}
FIRST = {"x": 0.5, "y": 10.0}

optuna.logging.set_verbosity(optuna.logging.WARNING)


def join(storage: BaseStorage) -> SharedTrials:
    """A further search on a storage."""
    return SharedTrials(storage, "bowl", SPACE, FIRST, seed=0)


def value_of(trial: FrozenTrial) -> float:
    return -((trial.params["x"] - 1) ** 2) - (trial.params["y"] / 50 - 1) ** 2


def run(search: SharedTrials, most: int) -> int:
    """Searches to the end; returns how many trials that took."""
    computed = 0
    while trial := search.next(most):
        search.finish(trial, value_of(trial))
        computed += 1
    return computed


def complete(storage: BaseStorage) -> list[FrozenTrial]:
    study = optuna.load_study(study_name="bowl", storage=storage)
    return study.get_trials(states=(TrialState.COMPLETE,))


def alone(most: int) -> list[dict[str, Any]]:
    """The trials of a search of its own."""
    storage = InMemoryStorage()
    assert run(join(storage), most) == most
    return [trial.params for trial in complete(storage)]


@settings(max_examples=20)
@given(
    # Which of three searches begins or ends a trial next; 3 to 5 kill one and start another.
    schedule=st.lists(st.integers(0, 5), max_size=60)
)
def test_every_trial_is_computed_and_all_searches_find_the_same(schedule) -> None:
    storage, most = InMemoryStorage(), 16
    searches = [join(storage) for _ in range(3)]
    at_work: dict[int, FrozenTrial] = {}
    for event in schedule:
        number = event % 3
        if event >= 3:
            at_work.pop(number, None)
            searches[number] = join(storage)
        elif trial := at_work.pop(number, None):
            searches[number].finish(trial, value_of(trial))
        elif trial := searches[number].next(most):
            at_work[number] = trial
    for search in searches:
        run(search, most)
    trials = complete(storage)
    assert len(trials) == most
    assert trials[0].params == FIRST
    # No two searches draw the same.
    assert len({trial.params["x"] for trial in trials}) == most
    assert all(trial.value == value_of(trial) for trial in trials)
    greatest = max(map(value_of, trials))
    for search in searches:
        parameters, value = search.best()
        assert value == greatest
        assert parameters == searches[0].best()[0]


@pytest.mark.parametrize("killed_at", [0, 3, 13])
def test_a_search_that_was_killed_goes_on_as_one_that_was_not(killed_at) -> None:
    storage = InMemoryStorage()
    run(join(storage), killed_at)
    assert join(storage).next(18) is not None  # and is killed
    # A trial that no search of ours entered is nobody's.
    optuna.load_study(study_name="bowl", storage=storage).ask()
    run(join(storage), 18)
    assert [trial.params for trial in complete(storage)] == alone(18)


class Crowded(InMemoryStorage):
    """Lets another search enter a trial first, whenever one enters one."""

    other: SharedTrials | None = None

    def create_new_trial(self, study_id: int, template_trial: FrozenTrial | None = None) -> int:
        other, self.other = self.other, None
        if other is not None:
            trial = other.next(9)
            other.finish(trial, value_of(trial))
            self.other = other
        return super().create_new_trial(study_id, template_trial)


def test_a_number_that_another_search_was_faster_to_take_is_not_computed_twice() -> None:
    storage = Crowded()
    one, storage.other = join(storage), join(storage)
    assert one.next(9) is None  # the other one computed all
    trials = complete(storage)
    assert len(trials) == 9
    assert len({trial.params["x"] for trial in trials}) == 9
