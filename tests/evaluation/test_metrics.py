"""The metric counts what rain counts do, and two processes count what one counts."""

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import torch.distributed
import torch.multiprocessing
from numpy.typing import NDArray

from derain.evaluation.counts import SCORES, mean_over_scans, or_none
from derain.evaluation.metrics import RainMetrics
from derain.evaluation.rain_counts import RainCounts
from derain.scan import Scan

CLASSES = {0: "ground", 3: "rain", 7: "car", 255: "nobody knows"}
ARGUMENTS = (CLASSES, (3,), (255,))


def labelled(seed: int, points: int = 60) -> tuple[Scan, NDArray[np.bool_]]:
    random = np.random.default_rng(seed)
    scan = Scan(random.uniform(-90, 90, (points, 3)).astype(np.float32))
    return scan.with_label(random.choice(list(CLASSES), points)), random.random(points) < 0.4


def counted(*seeds: int) -> RainMetrics:
    metrics = RainMetrics(*ARGUMENTS)
    for seed in seeds:
        metrics.update(*labelled(seed))
    return metrics


def report(metrics: RainMetrics) -> dict[str, Any]:
    computed = {name: value.item() for name, value in metrics.compute().items()}
    counts = metrics.counts()
    return {
        "compute": {name: or_none(value) for name, value in computed.items()},  # NaN is not NaN
        "cells": counts.cells.tolist(),
        "per scan": counts.per_scan,
        "by range": counts.by_range(),
    }


def test_it_counts_what_rain_counts_do_and_scores_by_them() -> None:
    metrics, expected = counted(1, 2, 3), RainCounts(*ARGUMENTS)
    for seed in (1, 2, 3):
        expected.add(*labelled(seed))
    counts = metrics.counts()
    np.testing.assert_array_equal(counts.cells, expected.cells)
    assert counts.per_scan == expected.per_scan
    computed = metrics.compute()
    assert {(value.shape, value.dtype) for value in computed.values()} == {((), torch.float32)}
    for score in SCORES:
        assert computed[score] == pytest.approx(getattr(expected.pooled(), score))
        mean = mean_over_scans(expected.per_scan, score)
        assert computed[f"{score}_per_scan"] == pytest.approx(mean)


@pytest.mark.filterwarnings("ignore:The ``compute`` method of metric RainMetrics was called before")
def test_a_reset_metric_has_no_score() -> None:
    metrics = counted(5)
    metrics.reset()
    assert metrics.counts().per_scan == []
    assert all(value.isnan() for value in metrics.compute().values())
    metrics.update(*labelled(6))
    assert report(metrics) == report(counted(6))


def test_counts_survive_pickling_and_half_precision() -> None:
    metrics = pickle.loads(pickle.dumps(counted(7))).to(torch.bfloat16)
    metrics.update(*labelled(8))
    assert report(metrics) == report(counted(7, 8))


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")
def test_counts_are_the_same_on_a_gpu() -> None:
    metrics = counted(9).cuda()
    metrics.update(*labelled(10))
    assert report(metrics) == report(counted(9, 10))


# The seeds of the scans that each of two processes sees.
SHARES: dict[str, tuple[list[int], list[int]]] = {
    "uneven": ([20, 21, 22], [23]),
    "one has none": ([24, 25], []),
    "neither has any": ([], []),
}
LATER = 26


def count_in_one_of_two_processes(rank: int, folder: str) -> None:
    torch.distributed.init_process_group(
        "gloo", init_method=f"file://{folder}/rendezvous", rank=rank, world_size=2
    )
    reports = {}
    for name, share in SHARES.items():
        metrics = counted(*share[rank])
        metrics.cells += 2**40
        before = report(metrics)
        metrics.update(*labelled(LATER))
        reports[name] = before, report(metrics)
    torch.distributed.destroy_process_group()
    Path(folder, f"{rank}.pickle").write_bytes(pickle.dumps(reports))


@pytest.mark.filterwarnings("ignore:The ``compute`` method of metric RainMetrics was called before")
def test_two_processes_count_what_one_counts(tmp_path: Path) -> None:
    # Under this name a spawned process finds the function, through pytest's pythonpath.
    from evaluation.test_metrics import count_in_one_of_two_processes as count

    torch.multiprocessing.spawn(count, (str(tmp_path),), nprocs=2)
    expected = {}
    for name, (first, second) in SHARES.items():
        before = counted(*first, *second)
        later = counted(*first, LATER, *second, LATER)
        before.cells += 2**41
        later.cells += 2**41
        expected[name] = report(before), report(later)
    for rank in (0, 1):
        assert pickle.loads((tmp_path / f"{rank}.pickle").read_bytes()) == expected
