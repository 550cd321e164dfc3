"""Candidates for a network that is trained: bounds of the rain that it finds."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.evaluation.counts import Counts
from derain.models.base import DerainingModule
from derain.scan import Scan
from derain.views.candidate_fit import RAIN_INSIDE, fit_candidates
from derain.views.candidates import Candidates
from derain.views.probability import probability_of_rain


@dataclass(frozen=True)
class FittedCandidates:
    """Candidates, and what a network gains or loses by them on the scans they were fitted to.

    Attributes:
        candidates: The candidates; their share of the rain is of that which the network finds.
        scans: Number of scans.
        before: Points as the network judges them all.
        after: The same points, where nothing but candidates is rain.
    """

    candidates: Candidates
    scans: int
    before: Counts
    after: Counts

    def __str__(self) -> str:
        return (
            f"Candidates: {self.candidates} that the network finds\n"
            f"IoU on these {self.scans} scans {self.before.iou:.4f} where all points are judged, "
            f"{self.after.iou:.4f} where candidates are"
        )


def candidates_of_findings(
    model: DerainingModule,
    scans: Iterable[Scan],
    card: DataCard,
    inside: float = RAIN_INSIDE,
) -> FittedCandidates:
    """Fits candidates to what a trained network calls rain and is rain.

    Rain that it does not find is not lost to it by bounds: so they may be narrower than those of
    all rain, of which a label's last thousandth may lie anywhere.

    Args:
        model: A trained model. What candidates it has are not looked at.
        scans: Scans with labels, their intensities in the unit of the model's training data.
        card: Their data card.
        inside: Share of the rain it finds that is to be within the bounds.

    Raises:
        InputError: Scans in which it finds no rain, or none that bounds would tell from the rest;
            a model that sees several scans at a time.
    """
    model = model.eval().cpu()
    judged = [_judged(model, scan, card) for scan in scans]
    candidates = fit_candidates(
        ((scan, called & rain) for scan, called, rain in judged), model.channels, inside
    )
    if candidates is None:
        raise InputError(
            "--candidates",
            "no bounds tell rain that the network finds in these scans from the rest",
            "Give scans with rain, or leave it out.",
        )
    before, after = Counts(), Counts()
    for scan, called, rain in judged:
        before += Counts.of(called, rain)
        after += Counts.of(called & candidates.among(scan), rain)
    return FittedCandidates(candidates, len(judged), before, after)


def _judged(
    model: DerainingModule, scan: Scan, card: DataCard
) -> tuple[Scan, NDArray[np.bool_], NDArray[np.bool_]]:
    """The points of which it is known what they are, which the network calls rain, which are."""
    spec = replace(model.spec, candidates=None)
    view = spec.make_view()
    if not view.window.is_one_scan:
        raise InputError(
            "--candidates", "the network sees several scans at a time", "Leave the option out."
        )
    seen = view(scan)
    with torch.inference_mode():
        logits = model(**{name: torch.from_numpy(each) for name, each in seen.inputs().items()})
    called = seen.back(probability_of_rain(logits.numpy())) > spec.threshold
    known = ~card.unknown_of(scan)
    return scan.take(known), called[known], card.rain_of(scan)[known]
