"""Images are padded to sizes that halve evenly, and cut back to what they were."""

import numpy as np
import torch
from hypothesis import given
from hypothesis import strategies as st

from derain.models.layers.image_size import pad_to_multiple


@given(
    height=st.integers(1, 40),
    width=st.integers(1, 40),
    multiple=st.integers(1, 20),
    value=st.sampled_from([0.0, -1.0]),
)
def test_new_pixels_are_below_and_on_the_right(
    height: int, width: int, multiple: int, value: float
) -> None:
    image = np.random.default_rng(0).normal(size=(2, 3, height, width)).astype(np.float32)
    below = next(n for n in range(multiple) if (height + n) % multiple == 0)
    right = next(n for n in range(multiple) if (width + n) % multiple == 0)
    expected = np.pad(image, ((0, 0), (0, 0), (0, below), (0, right)), constant_values=value)
    padded = pad_to_multiple(torch.from_numpy(image), multiple, value)
    np.testing.assert_array_equal(padded, expected)
    np.testing.assert_array_equal(padded[..., :height, :width], image)


def test_an_image_that_fits_comes_back_as_it_is() -> None:
    image = torch.zeros(1, 2, 32, 48)
    assert pad_to_multiple(image, 16, value=-1.0) is image


def test_the_dtype_stays() -> None:
    assert pad_to_multiple(torch.zeros(1, 1, 3, 5).bfloat16(), 4, 0.0).dtype is torch.bfloat16
