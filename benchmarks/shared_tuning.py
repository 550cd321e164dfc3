"""Measures the cost of several searches that share the trials of a tuning.

    python -m benchmarks.shared_tuning WADS/sequences/36/velodyne --filters dsor dror

A single search has the values of all trials before its own; of several simultaneous searches, each
lacks those that the others are computing. Here they take turns: all draw, then all compute.
Printed is the IoU of the best of 100 trials, by the number of searches: mean and range over seeds.
"""

import argparse
from pathlib import Path

import optuna

from benchmarks.labelled import read_labelled
from derain.cards.card import load_card
from derain.evaluation.text_tables import markdown_table
from derain.export.shared_trials import SharedTrials
from derain.export.tuning import (
    LabelledNeighbourhoods,
    distributions_of,
    neighbours_to_find,
    pooled_iou,
)
from derain.filters import filter_from

SEARCHES = (1, 2, 4, 8)


def main() -> None:
    """Prints a table of filters and numbers of searches."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="of scans, with labels/ beside it")
    parser.add_argument("--filters", nargs="+", default=["dsor", "dror"])
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--scans", type=int, default=2)
    arguments = parser.parse_args()

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    rows = []
    for name in arguments.filters:
        scans = _scans(name, arguments.folder, arguments.scans)
        default = pooled_iou(filter_from(name, {}), scans)
        for searches in SEARCHES:
            best = [
                _best(name, scans, searches, arguments.trials, seed)
                for seed in range(arguments.seeds)
            ]
            mean = sum(best) / len(best)
            spread = f"{min(best):.4f} to {max(best):.4f}"
            rows.append((name, str(searches), f"{default:.4f}", f"{mean:.4f}", spread))
    print(markdown_table(("filter", "searches", "defaults", "tuned, mean", "range"), rows))


def _scans(name: str, folder: Path, most: int) -> list[LabelledNeighbourhoods]:
    card, neighbours = load_card("wads"), neighbours_to_find(name)
    return [
        LabelledNeighbourhoods.of(read_labelled(path), card, neighbours, threads=1)
        for path in sorted(folder.glob("*.bin"))[:most]
    ]


def _best(
    name: str, scans: list[LabelledNeighbourhoods], searches: int, trials: int, seed: int
) -> float:
    """The greatest IoU that so many searches find together, taking turns."""
    storage = optuna.storages.InMemoryStorage()
    default, distributions = filter_from(name, {}), distributions_of(name)
    first = {parameter: getattr(default, parameter) for parameter in distributions}
    sharing = [SharedTrials(storage, name, distributions, first, seed) for _ in range(searches)]
    while True:
        drawn = [(search, search.next(trials)) for search in sharing]
        at_work = {trial.number: (search, trial) for search, trial in drawn if trial}
        if not at_work:
            return sharing[0].best()[1]
        for search, trial in at_work.values():
            search.finish(trial, pooled_iou(filter_from(name, trial.params), scans))


if __name__ == "__main__":
    main()
