"""What methods cost: every run of every scan, each method alone, and a failure that is told."""

import pickle
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from derain.export.bench.bench_entries import BenchEntry, bench_entries
from derain.export.bench.cost import Timing, measure_cost, measure_in_process
from derain.export.bench.labelled_frames import LabelledFrames
from derain.export.methods import load_method
from derain.export.timing import STAGES, WARM_UP
from derain.scan import Scan
from derain.system.stopwatch import Stopwatch


def test_each_run_is_timed_by_stage(labelled: LabelledFrames) -> None:
    milliseconds = iter(range(100))

    def method(scan: Scan, stopwatch: Stopwatch) -> np.ndarray:
        stopwatch.milliseconds["network"] = next(milliseconds)
        return np.zeros(len(scan), bool)

    row = BenchEntry("timed", "outdet", lambda threads: method)
    cost = measure_in_process(row, Timing(labelled.frames, threads=1, repeats=2))
    stages = cost.times.stages
    assert list(stages) == list(STAGES)
    runs = range(WARM_UP, WARM_UP + 2 * 3)
    np.testing.assert_array_equal(stages["network"], runs)
    assert (stages["view"] == 0).all()
    assert (stages["read"] > 0).all()
    assert cost.times.percentile(50, "network") == WARM_UP + 2.5
    total = stages["read"] + stages["network"]
    assert cost.times.percentile(95) == np.percentile(total, 95)


@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is Linux's to tell")
def test_a_process_of_its_own_holds_little_but_the_method(labelled: LabelledFrames) -> None:
    (row,) = bench_entries(["dsor"])
    held = np.ones(300_000_000, np.uint8)  # in this process, not in that one
    cost = measure_cost(row, Timing(labelled.frames[:1], threads=1, repeats=1))
    assert len(cost.times.stages["view"]) == 1
    assert held.nbytes / 2**20 > 250 > cost.peak_memory > 20


@pytest.mark.parametrize(
    ("ready", "reason"),
    [
        (partial(load_method, "moved.onnx", {}), "moved.onnx: no such file"),
        (int, "'int' object is not callable"),  # made without complaint, and of no use
    ],
)
def test_a_method_that_cannot_be_timed_says_why(
    labelled: LabelledFrames, ready: Callable[[int], Any], reason: str
) -> None:
    cost = measure_cost(BenchEntry("broken", "outdet", ready), Timing(labelled.frames, repeats=1))
    assert cost.failure is not None
    assert cost.failure.startswith(reason)
    assert np.isnan(cost.times.percentile(50))
    assert cost.peak_memory is None


def test_methods_can_be_sent_to_another_process(labelled: LabelledFrames, onnx_model: Path) -> None:
    training = [labelled.read(frame) for frame in labelled.frames]
    rows = bench_entries(
        [str(onnx_model), "dror", "position", "intensity", "all", "none"],
        lambda: ((scan, scan.label == 3) for scan in training),
    )
    for row in rows:
        there = pickle.loads(pickle.dumps(row))
        for scan in training:
            np.testing.assert_array_equal(
                there.ready(1)(scan, Stopwatch()), row.ready(1)(scan, Stopwatch())
            )
