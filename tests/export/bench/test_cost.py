"""What methods cost: every run of every scan, each method alone, and a failure that is stated."""

import os
import sys
from functools import partial

import numpy as np
import pytest

from derain.export.bench.bench_entries import BenchEntry, bench_entries
from derain.export.bench.cost import Effort, measure_cost
from derain.export.methods import load_method


@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is known on Linux alone")
def test_a_process_of_its_own_holds_little_but_the_method(labelled) -> None:
    (row,) = bench_entries(["dsor"])
    held = np.ones(300_000_000, np.uint8)  # in this process, not in that one
    cost = measure_cost(row, labelled.frames[:1], Effort(threads=1, repeats=1))
    assert len(cost.times.stages["view"]) == 1
    assert held.nbytes / 2**20 > 250 > cost.peak_memory > 20


def test_a_method_that_cannot_be_timed_states_why(labelled) -> None:
    broken = BenchEntry("broken", "outdet", partial(load_method, "moved.onnx", {}))
    cost = measure_cost(broken, labelled.frames, Effort(repeats=1))
    assert cost.failure.startswith("moved.onnx: no such method or file")
    assert np.isnan(cost.times.percentile(50))
    assert cost.peak_memory is None


def test_the_error_of_a_process_that_died_does_not_advise_fewer_of_them(labelled) -> None:
    cost = measure_cost(BenchEntry("dying", "dying", die), labelled.frames, Effort(repeats=1))
    assert "died" in cost.failure
    assert "--workers" not in cost.failure


def die(threads: int) -> None:
    """Ends the process, as the system does where memory is full."""
    os._exit(threads)
