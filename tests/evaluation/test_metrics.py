"""Rain metrics against scikit-learn, and one process against two."""

import math
import pickle
from dataclasses import astuple
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import torch.distributed
import torch.multiprocessing
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from torch import Tensor

from derain.errors import InputError
from derain.evaluation.counts import or_none
from derain.evaluation.metrics import SCORES, ClassCounts, Counts, RainMetrics

CLASSES = {0: "ground", 3: "rain", 7: "car", 110: "snow"}
NAN = math.nan
approx = partial(pytest.approx, nan_ok=True)
RAIN = (3, 110)
Batch = tuple[Tensor, Tensor, Tensor, Tensor, int]

counts = st.integers(0, 2**40)
any_counts = st.builds(Counts, counts, counts, counts, counts)


def random_batch(
    seed: int, scans: int = 4, points: int = 60, labels: tuple[int, ...] = ()
) -> Batch:
    """Points of ``scans`` scans, shuffled together."""
    random = np.random.default_rng(seed)
    label = random.choice(labels or tuple(CLASSES), points)
    predicted = np.isin(label, RAIN) ^ (random.random(points) < 0.3)
    distance = random.uniform(0, 120, points).astype(np.float32)
    scan = random.integers(0, max(scans, 1), points)
    return (
        torch.from_numpy(predicted),
        torch.from_numpy(label),
        torch.from_numpy(distance),
        torch.from_numpy(scan),
        scans,
    )


def counted(*batches: Batch) -> RainMetrics:
    metrics = RainMetrics(CLASSES, RAIN)
    for batch in batches:
        metrics.update(*batch)
    return metrics


def total(parts: list[Counts]) -> Counts:
    return Counts(*map(sum, zip(*map(astuple, parts), strict=True)))


def reference_scores(truth: NDArray[np.bool_], predicted: NDArray[np.bool_]) -> dict[str, float]:
    # Imported here so that the processes that a test below starts do without it.
    from sklearn import metrics

    functions = (metrics.precision_score, metrics.recall_score, metrics.f1_score)
    scores = [float(function(truth, predicted, zero_division=NAN)) for function in functions]
    # This one takes no NaN.
    iou = metrics.jaccard_score(truth, predicted) if (truth | predicted).any() else NAN
    return dict(zip(SCORES, [*scores, float(iou)], strict=True))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    "labels", [(), (0, 7), (3, 110)], ids=["mixed", "no rain", "nothing but rain"]
)
def test_scores_are_those_of_scikit_learn(seed: int, labels: tuple[int, ...]) -> None:
    batches = [random_batch(seed, labels=labels), random_batch(100 + seed, scans=2)]
    truths, predictions = [], []
    for predicted, label, _, scan, scans in batches:
        for number in range(scans):
            truths.append(np.isin(label[scan == number].numpy(), RAIN))
            predictions.append(predicted[scan == number].numpy())
    pooled = reference_scores(np.concatenate(truths), np.concatenate(predictions))
    per_scan = [reference_scores(*pair) for pair in zip(truths, predictions, strict=True)]

    metrics = counted(*batches)
    expected = dict(pooled)
    for score in SCORES:
        of_scans = [scores[score] for scores in per_scan if not math.isnan(scores[score])]
        expected[f"{score}_per_scan"] = float(np.mean(of_scans)) if of_scans else math.nan
        assert getattr(metrics.pooled(), score) == approx(pooled[score], rel=1e-12)
        assert [getattr(scan, score) for scan in metrics.per_scan()] == approx(
            [scores[score] for scores in per_scan], rel=1e-12
        )
    computed = metrics.compute()
    assert {name: value.item() for name, value in computed.items()} == approx(expected)
    assert {(value.shape, value.dtype) for value in computed.values()} == {((), torch.float32)}


@given(any_counts)
def test_f1_and_iou_are_one_score_on_two_scales(counts: Counts) -> None:
    assert counts.f1 == approx(2 * counts.iou / (1 + counts.iou), rel=1e-12)


@given(any_counts)
def test_f1_is_the_harmonic_mean_of_precision_and_recall(counts: Counts) -> None:
    if counts.true_positive:
        mean = 2 / (1 / counts.precision + 1 / counts.recall)
        assert counts.f1 == pytest.approx(mean, rel=1e-12)


@pytest.mark.parametrize(
    ("counts", "scores"),
    [
        (Counts(0, 0, 0, 0), (NAN, NAN, NAN, NAN)),
        (Counts(0, 0, 0, 9), (NAN, NAN, NAN, NAN)),
        (Counts(0, 1, 0, 8), (0, NAN, 0, 0)),
        (Counts(0, 0, 1, 8), (NAN, 0, 0, 0)),
        (Counts(0, 1, 1, 7), (0, 0, 0, 0)),
        (Counts(9, 0, 0, 0), (1, 1, 1, 1)),
    ],
    ids=["no points", "no rain", "no rain, one error", "rain missed", "all wrong", "only rain"],
)
def test_a_score_is_undefined_where_its_denominator_is_zero(
    counts: Counts, scores: tuple[float, ...]
) -> None:
    assert (counts.precision, counts.recall, counts.f1, counts.iou) == approx(scores)


@given(st.lists(st.integers(0, 2**31), max_size=5), st.integers(0, 3), st.integers(0, 40))
def test_classes_ranges_and_scans_add_up_to_all_points(
    seeds: list[int], scans: int, points: int
) -> None:
    metrics = counted(*(random_batch(seed, scans, points if scans else 0) for seed in seeds))
    pooled = metrics.pooled()
    by_class = metrics.by_class().values()
    assert total([Counts(0, 0, 0, 0), *metrics.per_scan()]) == pooled
    assert total(list(metrics.by_range().values())) == pooled
    assert sum(c.called_rain for c in by_class if c.rain) == pooled.true_positive
    assert sum(c.called_rain for c in by_class if not c.rain) == pooled.false_positive
    assert sum(c.points for c in by_class) == sum(astuple(pooled))
    assert len(metrics.per_scan()) == scans * len(seeds)


def test_each_class_tells_what_it_lost() -> None:
    label = torch.tensor([0, 0, 0, 0, 3, 3, 3])
    predicted = torch.tensor([True, False, False, False, True, True, False])
    by_class = counted((predicted, label, torch.ones(7), torch.zeros(7).long(), 1)).by_class()
    assert by_class == {
        "ground": ClassCounts(4, 1, rain=False),
        "rain": ClassCounts(3, 2, rain=True),
        "car": ClassCounts(0, 0, rain=False),
        "snow": ClassCounts(0, 0, rain=True),
    }
    assert [c.share_lost for c in by_class.values()] == approx([1 / 4, 2 / 3, NAN, NAN])


def test_a_band_starts_at_its_edge_and_the_last_takes_what_is_not_finite() -> None:
    distance = torch.tensor([0, 9.99, 10, 39.9, 80, 1e9, math.inf, -math.inf, math.nan])
    zeros = torch.zeros(9, dtype=torch.int64)
    by_range = counted((zeros.bool(), zeros, distance, zeros, 1)).by_range()
    assert {name: counts.true_negative for name, counts in by_range.items()} == {
        "0-10 m": 2,
        "10-20 m": 1,
        "20-40 m": 1,
        "40-80 m": 0,
        "80+ m": 5,
    }


def test_a_single_band_holds_everything() -> None:
    metrics = RainMetrics(CLASSES, RAIN, range_edges=(0,))
    metrics.update(*random_batch(seed=1))
    assert metrics.by_range() == {"0+ m": metrics.pooled()}


@pytest.mark.filterwarnings("ignore:The ``compute`` method of metric RainMetrics was called before")
def test_nothing_counted_has_no_score() -> None:
    metrics = counted()
    assert metrics.per_scan() == []
    assert metrics.pooled() == Counts(0, 0, 0, 0)
    assert all(value.isnan() for value in metrics.compute().values())


def test_a_scan_without_points_is_a_scan() -> None:
    metrics = counted(random_batch(seed=2, scans=1, points=5))
    nothing = torch.zeros(0, dtype=torch.int64)
    metrics.update(nothing.bool(), nothing, nothing.float(), nothing, 2)
    assert metrics.per_scan()[1:] == [Counts(0, 0, 0, 0)] * 2


def test_counts_stay_exact_beyond_float32_and_int32() -> None:
    one_raindrop = (
        torch.tensor([True]),
        torch.tensor([3]),
        torch.ones(1),
        torch.zeros(1).long(),
        1,
    )
    metrics = counted(one_raindrop)
    metrics.cells *= 2**40
    metrics.update(*one_raindrop)
    assert metrics.pooled() == Counts(2**40 + 1, 0, 0, 0)
    assert metrics.by_range()["0-10 m"].true_positive == 2**40 + 1
    assert metrics.by_class()["rain"] == ClassCounts(2**40 + 1, 2**40 + 1, rain=True)
    assert Counts(2**40, 1, 0, 0).precision < 1


def test_a_batch_can_be_scored_while_it_is_counted() -> None:
    first, second = random_batch(seed=3), random_batch(seed=4)
    metrics = counted(first)
    assert metrics(*second) == counted(second).compute()
    assert metrics.compute() == counted(first, second).compute()
    assert metrics.per_scan() == counted(first, second).per_scan()


def test_reset_forgets_everything() -> None:
    metrics = counted(random_batch(seed=5))
    metrics.reset()
    metrics.update(*random_batch(seed=6))
    assert metrics.per_scan() == counted(random_batch(seed=6)).per_scan()
    assert metrics.pooled() == counted(random_batch(seed=6)).pooled()


def test_metrics_survive_pickling() -> None:
    metrics = pickle.loads(pickle.dumps(counted(random_batch(seed=7))))
    metrics.update(*random_batch(seed=8))
    expected = counted(random_batch(seed=7), random_batch(seed=8))
    assert metrics.by_class() == expected.by_class()
    assert metrics.per_scan() == expected.per_scan()


def test_every_tensor_follows_to_another_device() -> None:
    metrics = counted(random_batch(seed=9)).to("meta")
    tensors = [*metrics.buffers(), metrics.cells, *metrics.scan_counts]
    assert {tensor.device.type for tensor in tensors} == {"meta"}


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")
def test_counts_are_the_same_on_a_gpu() -> None:
    metrics = counted(random_batch(seed=9)).cuda()
    predicted, label, distance, scan, scans = random_batch(seed=10)
    metrics.update(predicted.cuda(), label.cuda(), distance.cuda(), scan.cuda(), scans)
    expected = counted(random_batch(seed=9), random_batch(seed=10))
    assert metrics.by_range() == expected.by_range()
    assert metrics.per_scan() == expected.per_scan()


def test_half_precision_leaves_the_counts_alone() -> None:
    metrics = counted(random_batch(seed=11)).to(torch.bfloat16)
    metrics.update(*random_batch(seed=12))
    assert metrics.by_range() == counted(random_batch(seed=11), random_batch(seed=12)).by_range()


def report(metrics: RainMetrics) -> dict[str, Any]:
    computed = {name: value.item() for name, value in metrics.compute().items()}
    return {
        "compute": {name: or_none(value) for name, value in computed.items()},  # NaN is not NaN
        "pooled": metrics.pooled(),
        "per scan": metrics.per_scan(),
        "by class": metrics.by_class(),
        "by range": metrics.by_range(),
    }


# The seeds of the batches that each of two processes sees.
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
        metrics = counted(*map(random_batch, share[rank]))
        metrics.cells += 2**40
        before = report(metrics)
        metrics.update(*random_batch(LATER))
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
        before = counted(*map(random_batch, [*first, *second]))
        later = counted(*map(random_batch, [*first, LATER, *second, LATER]))
        before.cells += 2**41
        later.cells += 2**41
        expected[name] = report(before), report(later)
    for rank in (0, 1):
        assert pickle.loads((tmp_path / f"{rank}.pickle").read_bytes()) == expected


def test_an_unknown_label_is_named_and_nothing_is_counted() -> None:
    metrics = counted()
    predicted, label, distance, scan, scans = random_batch(seed=13)
    label[5] = 252
    with pytest.raises(InputError, match="labels: id 252 is no known class"):
        metrics.update(predicted, label, distance, scan, scans)
    assert metrics.pooled() == Counts(0, 0, 0, 0)


def test_points_of_unknown_class_are_not_counted() -> None:
    predicted, label, distance, scan, scans = random_batch(seed=15)
    known = (label != 7) & (label != 110)
    metrics = RainMetrics(CLASSES, [3], unknown=[110, 7])
    metrics.update(predicted, label, distance, scan, scans)
    expected = RainMetrics({0: "ground", 3: "rain"}, [3])
    expected.update(predicted[known], label[known], distance[known], scan[known], scans)
    assert 0 < known.sum() < len(known)
    assert report(metrics) == report(expected)


@pytest.mark.parametrize("scan_number", [-1, 4])
def test_a_scan_number_out_of_bounds_is_refused_and_nothing_is_counted(scan_number: int) -> None:
    metrics = counted()
    predicted, label, distance, scan, scans = random_batch(seed=14)
    scan[7] = scan_number
    with pytest.raises(RuntimeError):
        metrics.update(predicted, label, distance, scan, scans)
    assert metrics.pooled() == Counts(0, 0, 0, 0)
    assert metrics.per_scan() == []


@pytest.mark.parametrize(
    ("classes", "rain", "edges"),
    [
        ({0: "ground", 3: "rain"}, (4,), (0, 10)),
        ({0: "rain", 3: "rain"}, (3,), (0, 10)),
        ({0: "ground", 3: "rain"}, (3,), (5, 10)),
        ({0: "ground", 3: "rain"}, (3,), (0, 10, 10)),
        ({0: "ground", 3: "rain"}, (3,), (0, math.nan)),
        ({0: "ground", 3: "rain"}, (3,), ()),
    ],
)
def test_what_cannot_be_counted_by_is_refused(
    classes: dict[int, str], rain: tuple[int, ...], edges: tuple[float, ...]
) -> None:
    with pytest.raises(InputError):
        RainMetrics(classes, rain, edges)


def test_on_clean_data_whatever_is_called_rain_is_a_false_alarm() -> None:
    metrics = RainMetrics({0: "road", 1: "car"}, rain=())
    metrics.update(
        predicted=torch.tensor([True, False, False, True]),
        label=torch.tensor([0, 0, 1, 1]),
        range=torch.tensor([5.0, 5.0, 5.0, 15.0]),
        scan=torch.zeros(4, dtype=torch.int64),
        scans=1,
    )
    assert metrics.pooled() == Counts(0, 2, 0, 2)
    assert [c.share_lost for c in metrics.by_class().values()] == [0.5, 0.5]
