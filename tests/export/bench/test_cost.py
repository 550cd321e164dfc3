"""What methods cost: every run of every scan, each method alone, and a failure that is told."""

import pickle
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from derain.export.bench.contestants import Contestant, contestants
from derain.export.bench.cost import WARM_UP, Timing, measure_cost, run_alone
from derain.export.bench.scores import Labelled
from derain.export.methods import load_method
from derain.export.timing import STAGES
from derain.scan import Scan
from derain.system.stopwatch import Stopwatch


def test_each_run_is_timed_by_stage(labelled: Labelled) -> None:
    milliseconds = iter(range(100))

    def method(scan: Scan, stopwatch: Stopwatch) -> np.ndarray:
        stopwatch.milliseconds["network"] = next(milliseconds)
        return np.zeros(len(scan), bool)

    row = Contestant("timed", "outdet", lambda threads: method)
    cost = run_alone(row, Timing(labelled.scans, threads=1, repeats=2))
    assert list(cost.milliseconds) == list(STAGES)
    runs = range(WARM_UP, WARM_UP + 2 * 3)
    np.testing.assert_array_equal(cost.milliseconds["network"], runs)
    assert (cost.milliseconds["view"] == 0).all()
    assert (cost.milliseconds["read"] > 0).all()
    assert cost.percentile(50, "network") == WARM_UP + 2.5
    total = cost.milliseconds["read"] + cost.milliseconds["network"]
    assert cost.percentile(95) == np.percentile(total, 95)


@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is Linux's to tell")
def test_a_process_of_its_own_holds_little_but_the_method(labelled: Labelled) -> None:
    (row,) = contestants(["dsor"])
    held = np.ones(300_000_000, np.uint8)  # in this process, not in that one
    cost = measure_cost(row, Timing(labelled.scans[:1], threads=1, repeats=1))
    assert len(cost.milliseconds["view"]) == 1
    assert held.nbytes / 2**20 > 250 > cost.peak_memory > 20


@pytest.mark.parametrize(
    ("ready", "reason"),
    [
        (partial(load_method, "moved.onnx", {}), "moved.onnx: no such file"),
        (int, "'int' object is not callable"),  # made without complaint, and of no use
    ],
)
def test_a_method_that_cannot_be_timed_says_why(
    labelled: Labelled, ready: Callable[[int], Any], reason: str
) -> None:
    cost = measure_cost(Contestant("broken", "outdet", ready), Timing(labelled.scans, repeats=1))
    assert cost.failure is not None
    assert cost.failure.startswith(reason)
    assert np.isnan(cost.percentile(50))
    assert cost.peak_memory is None


def test_methods_can_be_sent_to_another_process(labelled: Labelled, onnx_model: Path) -> None:
    training = [labelled.read(path) for path in labelled.scans]
    rows = contestants(
        [str(onnx_model), "dror", "position", "intensity", "all", "none"],
        lambda: ((scan, scan.label == 3) for scan in training),
    )
    for row in rows:
        there = pickle.loads(pickle.dumps(row))
        for scan in training:
            np.testing.assert_array_equal(
                there.ready(1)(scan, Stopwatch()), row.ready(1)(scan, Stopwatch())
            )
