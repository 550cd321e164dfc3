"""Repetitions are found whatever the numbers, also where hashes agree."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from derain.weather.alike import FEWEST_SAMPLED, MULTIPLIER, ONE_IN, repetitions, seem_distinct


@given(st.lists(st.integers(0, 2**32 - 1) | st.integers(0, 20), max_size=200))
def test_each_number_is_left_once_and_the_others_repeat_it(values: list[int]) -> None:
    numbers = np.array(values, np.uint32)
    repeating, repeated = repetitions(numbers)
    np.testing.assert_array_equal(numbers[repeating], numbers[repeated])
    left = np.delete(numbers, repeating)
    assert sorted(left) == sorted(set(values))
    assert not set(repeating) & set(repeated)


def test_numbers_of_one_slot_are_told_apart() -> None:
    # What the multiplier makes 0, 1, 2 and so on of, so that all upper bits are 0.
    inverse = pow(MULTIPLIER, -1, 2**32)
    numbers = np.array([place * inverse % 2**32 for place in range(2000)] * 2, np.uint32)
    repeating, repeated = repetitions(numbers)
    assert len(repeating) == 2000
    np.testing.assert_array_equal(np.abs(repeating - repeated), 2000)


def test_a_sample_shows_whether_many_numbers_repeat_others() -> None:
    generator = np.random.default_rng(0)
    many = np.unique(generator.integers(0, 2**32, 2 * ONE_IN * FEWEST_SAMPLED, np.uint32))
    generator.shuffle(many)
    assert seem_distinct(many)
    again = generator.choice(many, len(many) // 100)
    assert not seem_distinct(np.concatenate([many, again]))
    assert not seem_distinct(many[: FEWEST_SAMPLED * ONE_IN // 2])  # too few to say so
