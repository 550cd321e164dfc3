"""Candidates for a network that is trained: bounds of the rain that it finds."""

from collections.abc import Iterable
from dataclasses import astuple, dataclass, replace
from inspect import signature

import numpy as np
import torch

from derain.cards.card import DataCard
from derain.cards.rain_found import require_rain
from derain.errors import InputError, counted
from derain.evaluation.counts import Counts
from derain.export.onnx_file import evaluation_on_cpu
from derain.models.base import DerainingModule
from derain.scan import Bools, Scan
from derain.views.candidate_fit import RAIN_INSIDE, fit_candidates
from derain.views.candidates import Bound, Candidates, narrower
from derain.views.morton import first_rows
from derain.views.probability import probability_of_rain


@dataclass(frozen=True)
class FittedCandidates:
    """Candidates, and what a network gains or loses by them on the scans they were fitted to.

    Attributes:
        candidates: The candidates. Their shares are of all the rain, found or not.
        scans: Number of scans.
        before: Points as the network judges them without these bounds.
        after: The same points, where nothing but candidates is rain.
    """

    candidates: Candidates
    scans: int
    before: Counts
    after: Counts

    def __str__(self) -> str:
        found = self.after.true_positive / self.before.true_positive
        return (
            f"Candidates: {self.candidates}, {found:.2%} of that which the network finds\n"
            f"IoU on {counted(self.scans, 'scan')} {self.before.iou:.4f} without them, "
            f"{self.after.iou:.4f} with them"
        )


def fit_network_candidates(
    model: DerainingModule,
    scans: Iterable[Scan],
    card: DataCard,
    inside: float = RAIN_INSIDE,
) -> FittedCandidates:
    """Fits candidates to what a trained network calls rain and is rain.

    Rain that it does not find is not lost to it by bounds: so they may be narrower than those of
    all rain, of which a label's last thousandth may lie anywhere. Where a network was trained with
    candidates, they stay within those: it was never taught what is outside them.

    Args:
        model: A trained model.
        scans: Scans with labels, their intensities in the unit of the model's training data.
        card: Their data card.
        inside: Share of the rain it finds that is to be within the bounds.

    Raises:
        InputError: Scans without rain, or in which it finds none, or none that bounds separate
            from the rest; a model that takes no candidates.
    """
    _require_candidates(model)
    with evaluation_on_cpu(model):
        judged = [_judged(model, scan, card) for scan in scans]
    require_rain(any(rain.any() for _, _, rain in judged), card, "--candidates")
    candidates = fit_candidates(
        ((scan, called & rain) for scan, called, rain in judged), model.channels, inside
    )
    if candidates is None:
        raise InputError(
            "--candidates",
            "no bounds separate the rain that the network finds in these scans from the rest",
            "Give scans with rain, or leave it out.",
        )
    if (own := model.spec.candidates) is not None:
        candidates = replace(candidates, bounds=narrower(candidates.bounds, own.bounds))
    before, after, bounded = Counts(), Counts(), Counts()
    for scan, called, rain in judged:
        among, rows = candidates.among(scan), first_rows(scan)
        before += Counts.of(called, rain)
        after += Counts.of(called & among, rain)
        bounded += Counts.of(among[rows], rain[rows])
    # So far their shares are of the rain that it finds; whoever reads them expects those of all.
    of_all_rain = replace(
        candidates,
        points=(bounded.true_positive + bounded.false_positive) / sum(astuple(bounded)),
        rain=bounded.recall,
        rain_share=bounded.precision,
    )
    return FittedCandidates(of_all_rain, len(judged), before, after)


def _require_candidates(model: DerainingModule) -> None:
    """Refuses a model that cannot be given candidates, before any scan is judged."""
    view = model.spec.make_view()
    seen = view.with_candidates(Candidates((Bound("range", most=1.0),)))(Scan.of(np.zeros((0, 4))))
    try:
        signature(model.forward).bind(**seen.inputs())
    except TypeError as error:
        reason = f"{model.NAME} judges every point alike ({error})"
        raise InputError("--candidates", reason, "Leave the option out.") from error


def _judged(model: DerainingModule, scan: Scan, card: DataCard) -> tuple[Scan, Bools, Bools]:
    """The points of known class: those that the network calls rain, and those that are rain."""
    seen = model.spec.make_view()(scan)
    with torch.inference_mode():
        logits = model(**{name: torch.from_numpy(each) for name, each in seen.inputs().items()})
    called = seen.back(probability_of_rain(logits.numpy())) > model.spec.threshold
    known = ~card.unknown_of(scan)
    return scan.take(known), called[known], card.rain_of(scan)[known]
