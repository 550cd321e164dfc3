"""The trials of a search for parameters, which searches of several processes share."""

import random
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import optuna
from optuna.distributions import BaseDistribution
from optuna.storages import BaseStorage
from optuna.trial import FrozenTrial, TrialState

# Attribute of a trial: how many trials had been drawn before it.
BEFORE = "drawn_before"

# Two searches that entered a trial at once would do so again: they wait up to this many seconds.
LONGEST_PAUSE = 0.1


class SharedTrials:
    """Draws trials by Optuna's tree-structured Parzen estimator, and keeps them in a storage.

    A search draws every trial before its own in memory, those of others too, from the random
    numbers of one seed: trial 12 has the same ones whoever draws it. So a search that was broken
    off draws what it would have drawn, and searches that share a storage draw different trials.

    Args:
        storage: Storage of the trials, shared with other searches.
        name: Of the study in the storage.
        distributions: Distribution of each parameter.
        first: Parameters of the first trial.
        seed: Of the random numbers.

    Attributes:
        study: The study in the storage.
    """

    def __init__(
        self,
        storage: BaseStorage,
        name: str,
        distributions: Mapping[str, BaseDistribution],
        first: Mapping[str, Any],
        seed: int,
    ) -> None:
        self.study = optuna.create_study(
            storage=storage, study_name=name, direction="maximize", load_if_exists=True
        )
        self._storage = storage
        self._study_id = storage.get_study_id_from_name(name)
        self._distributions = dict(distributions)
        sampler = optuna.samplers.TPESampler(seed=seed % 2**32)  # it takes no larger ones
        self._in_memory = optuna.create_study(direction="maximize", sampler=sampler)
        self._in_memory.enqueue_trial(dict(first))
        # How many trials are drawn here, and those of them whose value is not known yet.
        self._drawn = 0
        self._unknown: dict[int, optuna.Trial] = {}
        # A search that was killed left a trial. One that is at work has it computed twice, once.
        self._left = {trial.number for trial in self._trials() if not trial.state.is_finished()}

    def best(self) -> tuple[dict[str, Any], float]:
        """Parameters and value of the first best trial, the same for all searches of a storage."""
        complete = [trial for trial in self._trials() if trial.state.is_finished()]
        values = [float(trial.values[0]) for trial in complete]
        greatest = max(values)
        return complete[values.index(greatest)].params, greatest

    def next(self, most: int) -> FrozenTrial | None:
        """A trial to compute, which no other search computes unless it is one of the last.

        Args:
            most: Number of trials of all searches together.

        Returns:
            The trial, with its parameters; None where that many are complete.
        """
        while True:
            trials = self._trials()
            self._draw_again(trials)
            running = [trial for trial in trials if not trial.state.is_finished()]
            if len(trials) - len(running) >= most:
                return None
            # At the end those of other searches, too: they may have ended.
            all_are_drawn = len(trials) >= most
            for trial in running:
                if trial.number in self._left or all_are_drawn:
                    self._left.discard(trial.number)
                    return trial
            if new := self._new():
                return new
            time.sleep(random.uniform(0, LONGEST_PAUSE))

    def finish(self, trial: FrozenTrial, value: float) -> None:
        """Keeps the value of a trial; where another search was faster, its value is the same."""
        with suppress(RuntimeError):  # it was faster by less than a look at the storage
            self.study.tell(trial.number, value, skip_if_finished=True)

    def _trials(self) -> list[FrozenTrial]:
        """The trials in the storage, in order.

        Where two searches entered one with as many before it, the second is none. So is what no
        search entered, unless it is complete: earlier versions entered no other.
        """
        trials: list[FrozenTrial] = []
        for trial in self.study.get_trials(deepcopy=False):
            before = trial.user_attrs.get(BEFORE)
            complete = trial.state is TrialState.COMPLETE
            if before == len(trials) or (before is None and complete):
                trials.append(trial)
        return trials

    def _draw_again(self, trials: Sequence[FrozenTrial]) -> None:
        """Draws in memory what other searches drew, each with the values that are known by then."""
        self._learn_values(trials)
        while self._drawn < len(trials):
            self._draw()
            self._learn_values(trials)

    def _learn_values(self, trials: Sequence[FrozenTrial]) -> None:
        for place, drawn in list(self._unknown.items()):
            stored = trials[place]
            if not stored.state.is_finished():
                continue
            del self._unknown[place]
            if stored.params == drawn.params:
                self._in_memory.tell(drawn, stored.value)
            else:  # drawn by a search that knew other values, or of another seed
                self._in_memory.tell(drawn, state=TrialState.FAIL)
                self._in_memory.add_trial(stored)

    def _draw(self) -> optuna.Trial:
        trial = self._in_memory.ask(self._distributions)
        self._unknown[self._drawn] = trial
        self._drawn += 1
        return trial

    def _new(self) -> FrozenTrial | None:
        """Draws the next trial and enters it; None where another search was faster."""
        place = self._drawn
        running = optuna.trial.create_trial(
            state=TrialState.RUNNING,
            params=self._draw().params,
            distributions=self._distributions,
            user_attrs={BEFORE: place},
        )
        entered = self._storage.get_trial(self._storage.create_new_trial(self._study_id, running))
        if self._trials()[place].number == entered.number:
            return entered
        self.study.tell(entered.number, state=TrialState.FAIL)
        return None
