"""Times functions that take turns."""

import time
from collections.abc import Callable, Mapping


def milliseconds_in_turns(
    functions: Mapping[str, Callable[[], object]], rounds: int, runs: int = 1, warm_up: int = 1
) -> dict[str, list[float]]:
    """Times every function in each round, by name.

    They take turns, so that whatever else the machine does slows all of them alike.

    Args:
        functions: The functions, by name.
        rounds: Rounds.
        runs: Timed runs of each function in each round.
        warm_up: Runs before those: they fill the cache, which the last function filled with its
            own data.
    """
    times: dict[str, list[float]] = {name: [] for name in functions}
    for _ in range(rounds):
        for name, function in functions.items():
            for _ in range(warm_up):
                function()
            times[name] += [_milliseconds(function) for _ in range(runs)]
    return times


def _milliseconds(function: Callable[[], object]) -> float:
    start = time.perf_counter()
    function()
    return 1e3 * (time.perf_counter() - start)
