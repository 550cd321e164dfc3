"""Tuning finds what is there to be found, and goes on where it stopped."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import optuna
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from optuna.trial import TrialState

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export import tuning
from derain.export.storage import Storage
from derain.export.tuning import (
    LabelledNeighbourhoods,
    Tuned,
    neighbours_to_find,
    pooled_iou,
    search_space,
    tune_filter,
    tune_threshold,
)
from derain.filters import FILTERS, FilterDerainer, PointFilter, Span, filter_from
from derain.scan import Bools, Scan
from derain.views.neighbours import Neighbourhoods

CARD = DataCard("made up", {0: "solid", 3: "rain", 9: "unknown"}, rain=(3,), unknown=(9,))


def labelled(seed: int) -> Scan:
    label = np.where(np.arange(600) >= 540, 3, 0)
    label[:50] = 9
    return Scan.of(scene(600, seed)).with_label(label)


def neighbourhoods(scan: Scan, card: DataCard = CARD) -> LabelledNeighbourhoods:
    """As wide as any of derain's filters needs them."""
    return LabelledNeighbourhoods.of(scan, card, neighbours=12, threads=1)


def iou_of(filter: PointFilter, *seeds: int) -> float:
    """IoU of a filter that is run, over the scans of some seeds."""
    found = union = 0
    for scan in map(labelled, seeds):
        called, rain, known = FilterDerainer(filter, 1)(scan), scan.label == 3, scan.label != 9
        found += np.count_nonzero(called & rain)
        union += np.count_nonzero((called | rain) & known)
    return found / union


@pytest.fixture(scope="module")
def seen() -> list[LabelledNeighbourhoods]:
    return [neighbourhoods(labelled(seed)) for seed in (1, 2)]


def tune(
    name: str,
    scans: list[LabelledNeighbourhoods],
    trials: int,
    storage: Path | None = None,
    data: str = "a",
) -> tuple[Tuned, int]:
    """What tuning finds on scans of such names, and how many trials it computed."""
    computed: list[int] = []
    named = {f"{data}{number}": scan for number, scan in enumerate(scans)}
    place = None if storage is None else Storage(str(storage))
    tuned = tune_filter(name, named, trials, 0, place, lambda: computed.append(1))
    return tuned, len(computed)


@pytest.mark.parametrize("name", FILTERS)
def test_tuning_starts_from_the_defaults_and_ends_no_worse(name, seen) -> None:
    assert search_space(name)
    assert neighbours_to_find(name) == 12
    tuned, computed = tune(name, seen, 4)
    assert computed == 4
    assert tuned.iou == iou_of(filter_from(name, tuned.parameters), 1, 2)
    assert tuned.default_iou == iou_of(filter_from(name, {}), 1, 2)
    assert tuned.iou >= tuned.default_iou
    first, _ = tune(name, seen, 1)
    assert filter_from(name, first.parameters) == filter_from(name, {})


@dataclass(frozen=True)
class Near(PointFilter):
    """Calls a point rain if its third neighbour is near."""

    neighbours: int = 15
    reach: float = 5.0

    def judge(self, view: Neighbourhoods) -> Bools:
        return view.distances[:, self.neighbours - 1] < self.reach


def test_as_many_neighbours_are_found_as_any_trial_looks_at(monkeypatch) -> None:
    monkeypatch.setattr(FILTERS, "_members", dict(FILTERS))

    def add(**space: Span) -> None:
        FILTERS.add("near")(type("Near", (Near,), {"SPACE": space}))

    add()
    for ask in (search_space, neighbours_to_find):
        with pytest.raises(InputError, match="near: it cannot be tuned"):
            ask("near")
    for space, default in (({"width": (1.0, 2.0)}, "missing"), ({"reach": (6.0, 9.0)}, "5.0")):
        add(**space)
        with pytest.raises(InputError, match=f"near: its SPACE has .* default is {default}"):
            search_space("near")
    add(reach=(0.1, 50.0))
    assert neighbours_to_find("near") == 15
    add(neighbours=(10, 30), reach=(0.1, 50.0))
    assert neighbours_to_find("near") == 30
    scans = [LabelledNeighbourhoods.of(labelled(1), CARD, 30, threads=1)]
    tuned, _ = tune("near", scans, 5)
    assert tuned.iou == iou_of(filter_from("near", tuned.parameters), 1)


def test_tuning_finds_the_radius_that_parts_drops_from_a_wall() -> None:
    # A wall of points 0.1 m apart, and drops 2 m apart before it: any radius between parts them.
    y, z = np.meshgrid(np.arange(-3, 3, 0.1), np.arange(-3, 3, 0.1))
    wall = np.stack([np.full(y.size, 20.0), y.ravel(), z.ravel()], axis=1)
    drops = np.stack(np.meshgrid([4.0, 6, 8], [-4.0, -2, 0, 2, 4], [0.0, 2])).reshape(3, -1).T
    points = np.concatenate([wall, drops]).astype(np.float32)
    label = np.where(np.arange(len(points)) >= len(wall), 3, 0)
    seen = [neighbourhoods(Scan(points).with_label(label))]
    tuned, _ = tune("ror", seen, 60)
    assert tuned.iou == 1 > tuned.default_iou
    assert 0.1 < tuned.parameters["radius"] < 3


def test_a_stored_study_goes_on_with_the_same_scans_and_labels_alone(seen, tmp_path) -> None:
    storage = tmp_path / "study.db"
    for trials, run in ((4, 4), (7, 3), (7, 0)):
        tuned, computed = tune("dsor", seen, trials, storage)
        assert computed == run
    assert tuned == tune("dsor", seen, 7)[0]
    other = DataCard("made up", {0: "solid", 3: "rain", 9: "also rain"}, rain=(3, 9))
    relabelled = [neighbourhoods(labelled(seed), other) for seed in (1, 2)]
    for scans, data in ((seen, "b"), (relabelled, "a")):
        with pytest.raises(InputError, match="holds a study of dsor on other scans, labels or"):
            tune("dsor", scans, 9, storage, data)
    # Another filter has a study of its own in the same file.
    assert tune("ror", seen, 1, storage, data="b")[0].iou > 0


def trials_of(storage: Path) -> list[tuple[dict[str, Any], list[float]]]:
    """The complete trials of a search for DSOR's parameters."""
    study = optuna.load_study(study_name="dsor", storage=Storage(str(storage)).open())
    complete = study.get_trials(states=[TrialState.COMPLETE])
    return [(trial.params, trial.values) for trial in complete]


@pytest.mark.parametrize(
    ("killed_at", "ending"), [(0, "journal"), (3, "journal"), (13, "journal"), (3, "db")]
)
def test_a_search_that_was_killed_goes_on_as_one_that_was_not(
    seen, tmp_path, monkeypatch, killed_at, ending
) -> None:
    whole, broken = tmp_path / f"whole.{ending}", tmp_path / f"broken.{ending}"
    unbroken, _ = tune("dsor", seen, 16, whole)
    computed = []

    def killed(*arguments: Any) -> float:
        if len(computed) == killed_at:
            raise KeyboardInterrupt
        computed.append(pooled_iou(*arguments))
        return computed[-1]

    with monkeypatch.context() as patched:
        patched.setattr(tuning, "pooled_iou", killed)
        with pytest.raises(KeyboardInterrupt):
            tune("dsor", seen, 16, broken)
    assert tune("dsor", seen, 16, broken) == (unbroken, 16 - killed_at)
    assert trials_of(broken) == trials_of(whole)


@pytest.mark.parametrize("begun_at", [0, 4, 15])
def test_searches_at_the_same_time_share_the_trials(seen, tmp_path, monkeypatch, begun_at) -> None:
    """Another one begins, and ends, while the first is at work on a trial."""
    storage, computed, others = tmp_path / "study.db", [], []

    def beside_another(*arguments: Any) -> float:
        computed.append(pooled_iou(*arguments))
        if len(computed) == begun_at + 1:
            others.append(tune("dsor", seen, 16, storage)[0])
        return computed[-1]

    monkeypatch.setattr(tuning, "pooled_iou", beside_another)
    tuned, _ = tune("dsor", seen, 16, storage)
    trials = trials_of(storage)
    assert len(trials) == 16
    assert len({str(parameters) for parameters, _ in trials}) == 16
    assert [tuned] == others
    assert [tuned.iou] == max(iou for _, iou in trials)


def test_a_journal_that_can_no_longer_grow_is_named(seen, tmp_path, full_disk) -> None:
    journal = tmp_path / "study.journal"
    tune("ror", seen, 1, journal)
    journal.write_bytes(journal.read_bytes().rstrip().ljust(49_999) + b"\n")
    full_disk()
    with pytest.raises(InputError, match=r"study\.journal: .*File too large"):
        tune("ror", seen, 2, journal)


def test_a_closed_pipe_that_progress_is_printed_to_is_not_called_a_fault_of_the_journal(
    seen, tmp_path
) -> None:
    def print_progress() -> None:
        raise BrokenPipeError

    storage = Storage(str(tmp_path / "study.journal"))
    with pytest.raises(BrokenPipeError):
        tune_filter("ror", dict(enumerate(seen)), 1, 0, storage, print_progress)


# Two of them are neighbours: nothing lies midway.
PROBABILITIES = np.array([0, 0.1, np.nextafter(np.float32(0.1), 1), 0.5, 1], np.float32).tolist()

judged = st.integers(1, 30).flatmap(
    lambda points: st.tuples(
        arrays.arrays(np.float32, points, elements=st.sampled_from(PROBABILITIES)),
        arrays.arrays(bool, points),
    )
)


@given(st.lists(judged, min_size=1, max_size=3).filter(lambda s: any(r.any() for _, r in s)))
def test_the_best_threshold_is_that_of_trying_all(scans) -> None:
    probability = np.concatenate([p for p, _ in scans])
    rain = np.concatenate([r for _, r in scans])

    def iou(threshold: float) -> float:
        called = probability > threshold
        return np.count_nonzero(called & rain) / np.count_nonzero(called | rain)

    tuned = tune_threshold(scans, 0.5)
    assert 0 <= tuned.parameters["threshold"] <= 1
    assert iou(tuned.parameters["threshold"]) == tuned.iou == max(map(iou, [0, *probability]))
    assert tuned.default_iou == iou(0.5)
