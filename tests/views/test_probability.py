"""The probability of rain is the softmax's, whatever the logits."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.special import softmax

from derain.scan import Float32s
from derain.views.probability import probability_of_rain


def logits(reach: float) -> st.SearchStrategy[Float32s]:
    return hnp.arrays(
        np.float32,
        st.tuples(st.integers(0, 20), st.just(2)),
        elements=st.floats(-reach, reach, width=32),
    )


LARGEST = float(np.finfo(np.float32).max)


@given(logits(50.0))
def test_it_is_the_softmax(logits) -> None:
    probability = probability_of_rain(logits)
    assert probability.dtype == np.float32
    expected = softmax(logits.astype(np.float64), axis=1)[:, 1]
    np.testing.assert_allclose(probability, expected, atol=1e-7)


@given(logits(LARGEST))
def test_no_logit_overflows(logits) -> None:
    with np.errstate(all="raise", under="ignore"):
        probability = probability_of_rain(logits)
    assert ((probability >= 0) & (probability <= 1)).all()
    other = probability_of_rain(logits[:, ::-1])
    np.testing.assert_allclose(probability + other, 1, atol=1e-7)
