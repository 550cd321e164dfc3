"""Times of functions that take turns."""

import time
from collections.abc import Callable, Mapping


def milliseconds_in_turns(
    functions: Mapping[str, Callable[[], object]], rounds: int
) -> dict[str, list[float]]:
    """Times every function once a round, by name.

    Turn and turn about, so that whatever else the machine does hits all alike.
    """
    times: dict[str, list[float]] = {name: [] for name in functions}
    for _ in range(rounds):
        for name, function in functions.items():
            function()  # warms the cache that the last function filled with its own
            start = time.perf_counter()
            function()
            times[name].append(1e3 * (time.perf_counter() - start))
    return times
