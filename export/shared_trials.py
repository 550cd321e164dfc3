"""The trials of a search for parameters, which searches of several processes share."""

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import optuna
from optuna.distributions import BaseDistribution
from optuna.storages import BaseStorage
from optuna.trial import FrozenTrial, TrialState


class SharedTrials:
    """Draws trials by Optuna's tree-structured Parzen estimator, and keeps them in a storage.

    A search draws every trial up to its own in memory, those of others too, from the random numbers
    of one seed: trial 12 has the same ones whoever draws it. So a search that was broken off draws
    what it would have drawn, and searches that share a storage draw different trials.

    Args:
        storage: Where the trials are kept, and other searches may keep theirs.
        name: Of the study in the storage.
        distributions: What is drawn, by parameter.
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
        sampler = optuna.samplers.TPESampler(seed=seed)
        self._in_memory = optuna.create_study(direction="maximize", sampler=sampler)
        self._in_memory.enqueue_trial(dict(first))
        # What is drawn here, by number, and those of it whose value is not known yet.
        self._drawn = 0
        self._unknown: dict[int, optuna.Trial] = {}
        # A search that was killed left a trial. One that is at work has it computed twice, once.
        self._left = {trial.number for trial in self.study.trials if self._is_running(trial)}

    def best(self) -> tuple[dict[str, Any], float]:
        """Parameters and value of the first best trial, the same for all searches of a storage."""
        complete = self.study.get_trials(states=(TrialState.COMPLETE,))
        values = [float(trial.values[0]) for trial in complete]
        greatest = max(values)
        return complete[values.index(greatest)].params, greatest

    def next(self, most: int) -> FrozenTrial | None:
        """A trial to compute, which no other search computes unless it is one of the last.

        Args:
            most: How many trials all searches are to compute together.

        Returns:
            The trial, with its parameters; None where so many are complete.
        """
        while True:
            trials = self._draw_what_others_drew()
            complete = sum(trial.state is TrialState.COMPLETE for trial in trials)
            if complete >= most:
                return None
            running = [trial for trial in trials if self._is_running(trial)]
            # At the end those of other searches, too: nobody knows whether they are still there.
            nothing_to_draw = complete + len(running) >= most
            for trial in running:
                if trial.number in self._left or nothing_to_draw:
                    self._left.discard(trial.number)
                    return trial
            if new := self._new():
                return new

    def finish(self, trial: FrozenTrial, value: float) -> None:
        """Keeps the value of a trial; where another search was faster, its value is the same."""
        with suppress(RuntimeError):  # it was faster by less than a look at the storage
            self.study.tell(trial.number, value, skip_if_finished=True)

    def _draw_what_others_drew(self) -> list[FrozenTrial]:
        """Brings the study in memory up to the storage; returns the trials that are there."""
        trials = self.study.get_trials(deepcopy=False)
        self._learn_values(trials)
        while self._drawn < len(trials):
            self._draw()
            self._learn_values(trials)  # before the next, which depends on them
        return trials

    def _learn_values(self, trials: list[FrozenTrial]) -> None:
        """Tells the study in memory the values that the storage has by now."""
        for number, drawn in list(self._unknown.items()):
            stored = trials[number]
            if not stored.state.is_finished():
                continue
            del self._unknown[number]
            if stored.state is TrialState.COMPLETE and stored.params == drawn.params:
                self._in_memory.tell(drawn, stored.value)
                continue
            self._in_memory.tell(drawn, state=TrialState.FAIL)
            if stored.state is TrialState.COMPLETE:  # drawn by a search that knew other values
                self._in_memory.add_trial(stored)

    def _draw(self) -> optuna.Trial:
        trial = self._in_memory.ask(self._distributions)
        self._unknown[self._drawn] = trial
        self._drawn += 1
        return trial

    def _new(self) -> FrozenTrial | None:
        """Draws the next trial and enters it; None where another search entered one before it."""
        number = self._drawn
        running = optuna.trial.create_trial(
            state=TrialState.RUNNING,
            params=self._draw().params,
            distributions=self._distributions,
        )
        entered = self._storage.create_new_trial(self._study_id, running)
        trial = self._storage.get_trial(entered)
        if trial.number == number:
            return trial
        self.study.tell(trial.number, state=TrialState.FAIL)
        return None

    def _is_running(self, trial: FrozenTrial) -> bool:
        return (
            trial.state is TrialState.RUNNING and trial.params.keys() == self._distributions.keys()
        )
