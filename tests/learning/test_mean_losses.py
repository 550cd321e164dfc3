"""Means of losses: exact, whatever the order, over the scans that count."""

from fractions import Fraction

import numpy as np
import torch
from hypothesis import given
from hypothesis import strategies as st

from derain.learning.mean_losses import MeanLosses

BATCHES = st.lists(
    st.tuples(st.floats(-1e6, 1e6, width=32), st.floats(0, 1, width=32), st.integers(1, 16)),
    min_size=1,
    max_size=20,
)


def means(batches: list[tuple[float, float, int]]) -> dict[str, float]:
    metric = MeanLosses()
    for loss, part, scans in batches:
        metric.update({"loss": torch.tensor(loss), "part": torch.tensor(part)}, scans)
    return {name: mean.item() for name, mean in metric.compute().items()}


@given(BATCHES, st.randoms())
def test_each_batch_weighs_its_scans_and_the_order_does_not_matter(batches, shuffler) -> None:
    scans = sum(batch[2] for batch in batches)
    found = means(batches)
    for column, name in enumerate(("loss", "part")):
        exact = sum(Fraction(batch[column]) * batch[2] for batch in batches) / scans
        np.testing.assert_allclose(found[name], float(exact), rtol=1e-6, atol=1e-40)
    # Sums that are added up one after the other would differ in their last digits.
    shuffler.shuffle(batches)
    assert means(batches) == found


def test_a_batch_of_which_no_scan_counts_gives_the_names_and_nothing_else() -> None:
    counted = [(1.0, 0.25, 3), (3.0, 0.5, 1)]
    assert means([(float("nan"), float("inf"), 0), *counted]) == {"loss": 1.5, "part": 0.3125}
    assert list(means([(7.0, 7.0, 0)])) == ["loss", "part"]
    assert np.isnan(list(means([(7.0, 7.0, 0)]).values())).all()


def test_an_epoch_starts_anew() -> None:
    metric = MeanLosses()
    for loss in (5.0, 2.0):
        metric.reset()
        metric.update({"loss": torch.tensor(loss)}, 2)
    assert metric.compute()["loss"] == 2
