"""Colours of everything that shows scans."""

import numpy as np

from derain.pictures.palette import OUTCOMES, PROBABILITY, outcomes, rgb, shades


def test_shades_lie_between_their_colours_and_the_more_probable_is_brighter() -> None:
    share = np.array([-1.0, 0.0, 0.25, 0.5, 1.0, 2.0])
    first, middle, last = (np.array(rgb(colour)) for colour in PROBABILITY)
    between = np.round((first + middle) / 2)
    expected = np.array([first, first, between, middle, last, last])
    np.testing.assert_array_equal(shades(PROBABILITY, share), expected)
    # Source: luma of ITU-R BT.601.
    luma = shades(PROBABILITY, np.linspace(0, 1, 101)) @ np.array([0.299, 0.587, 0.114])
    assert (np.diff(luma) > 0).all()


def test_every_outcome_has_a_colour_of_its_own() -> None:
    assert rgb("#39c5ff") == (57, 197, 255)
    assert len(set(map(rgb, OUTCOMES.values()))) == 4
    predicted, rain = np.array([[0, 1, 0, 1], [0, 1, 1, 0]], bool)
    assert outcomes(predicted, rain).tolist() == [0, 1, 2, 3]
