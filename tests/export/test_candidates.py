"""A model judges its candidates as it does without bounds, and nothing else is rain."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from torch import Tensor

from derain.cards.card import load_card
from derain.errors import InputError
from derain.evaluation.counts import Counts
from derain.evaluation.hard_cases import hard_cases, scene
from derain.export.candidates import fit_network_candidates
from derain.export.runtime import Derainer
from derain.models.outdet import OutDet
from derain.scan import Scan
from derain.views.candidates import Bound, Candidates

from .conftest import shapes_of

WADS = load_card("wads")


def test_its_answer_for_candidates_is_bit_for_bit_that_of_the_model_without(
    onnx_model, judging_candidates, candidates
) -> None:
    of_all, of_candidates = Derainer(onnx_model, 1), Derainer(judging_candidates, 1)
    judged = 0
    for name, scan in [*hard_cases(largest=3000), ("scene", Scan.of(scene(2000)))]:
        # Rows at one position have one score; its first row decides whether it is a candidate.
        first = of_all.view(scan)
        among = np.zeros(len(scan), bool)
        among[first.judged] = candidates.among(scan)[first.first][first.inverse[first.judged]]
        expected = np.where(among, of_all.probability(scan), np.float32(0))
        np.testing.assert_array_equal(of_candidates.probability(scan), expected, err_msg=name)
        judged += int(among.sum())
    assert judged > 1000
    lengths = {name: shape[0] for name, shape in shapes_of(judging_candidates).items()}
    of_their_own = {"points": "points", "candidates": "candidates", "logits": "candidates"}
    shared = dict.fromkeys(("distances", "neighbours"), "neighbourhoods")
    assert lengths == {**of_their_own, **shared}


@pytest.fixture(scope="module")
def labelled() -> list[Scan]:
    """Two scenes whose drops are snow; one drop in twenty is of unknown class."""
    scans = []
    for seed in range(2):
        points = scene(2000, seed)
        drops = np.arange(len(points)) >= len(points) - 200
        label = np.where(drops, 110, 40)
        label[np.flatnonzero(drops)[::20]] = 0
        scans.append(Scan.of(points).with_label(label))
    return scans


def test_they_are_fitted_to_the_rain_that_the_network_finds(
    random_outdet, onnx_model, labelled
) -> None:
    card = replace(WADS, unknown=(0,))
    fitted = fit_network_candidates(random_outdet, labelled, card, inside=0.9)
    known = [scan.take(scan.label != 0) for scan in labelled]
    called = np.concatenate([Derainer(onnx_model, 1)(s)[s.label != 0] for s in labelled])
    among = np.concatenate([fitted.candidates.among(scan) for scan in known])
    rain = np.concatenate([scan.label == 110 for scan in known])
    before, after = Counts.of(called, rain), Counts.of(called & among, rain)
    assert (fitted.before, fitted.after, fitted.scans) == (before, after, 2)
    found = after.true_positive / before.true_positive
    assert 0.9 <= found <= 1
    assert before != after
    assert fitted.candidates.points < 0.9
    assert f"{found:.2%} of that which the network finds" in str(fitted)
    # The shares in the model's Spec are of all the rain, found or not.
    bounded = Counts.of(among, rain)
    assert fitted.candidates.points == pytest.approx(among.mean())
    assert fitted.candidates.rain == bounded.recall < found
    assert fitted.candidates.rain_share == bounded.precision


def test_bounds_of_nothing_are_refused(random_outdet, labelled) -> None:
    dry = [scan.with_label(np.full(len(scan), 40)) for scan in labelled]
    with pytest.raises(InputError, match=r"--candidates: no point of these scans is falling-snow"):
        fit_network_candidates(random_outdet, dry, WADS)
    blind = deepcopy(random_outdet)
    blind.adopt(replace(blind.spec, threshold=1.0))
    with pytest.raises(InputError, match=r"--candidates: no bounds separate .* leave it out"):
        fit_network_candidates(blind, labelled, WADS)


def test_a_model_that_was_trained_with_candidates_stays_within_them(
    random_outdet, labelled
) -> None:
    model = deepcopy(random_outdet)
    model.adopt(replace(model.spec, candidates=Candidates((Bound("range", most=8.0),))))
    fitted = fit_network_candidates(model, labelled, WADS, inside=0.9)
    bounds = {bound.channel: bound for bound in fitted.candidates.bounds}
    assert bounds["range"].most <= 8.0
    assert "intensity" in bounds


def test_a_network_whose_answers_depend_on_all_points_is_given_none(
    random_outdet, labelled, monkeypatch
) -> None:
    def forward(model: OutDet, points: Tensor, distances: Tensor, neighbours: Tensor) -> Tensor:
        raise AssertionError("it is refused before it judges a scan")

    monkeypatch.setattr(OutDet, "forward", forward)
    with pytest.raises(InputError, match="--candidates: outdet judges every point alike"):
        fit_network_candidates(random_outdet, labelled, WADS)
