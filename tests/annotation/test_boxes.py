"""Boxes and their corrections."""

import numpy as np
from scipy.spatial.transform import Rotation

from derain.annotation.boxes import Box, Correction
from derain.simulation.classes import TrackClass

BOX = Box(TrackClass.CAR, (20, 1, -0.6), (4.5, 1.8, 1.5), 35)


def test_a_box_holds_what_a_rotation_takes_into_its_frame() -> None:
    points = np.random.default_rng(0).uniform((16, -3, -2), (24, 5, 1), (5000, 3))
    turned = Rotation.from_euler("z", BOX.heading, degrees=True).inv().apply(points - BOX.centre)
    expected = (np.abs(turned) <= np.array(BOX.size) / 2).all(axis=1)
    assert 100 < expected.sum() < 4000
    assert np.array_equal(BOX.contains(points), expected)


def test_its_faces_are_part_of_it() -> None:
    box = Box(TrackClass.TARGET, (0, 0, 0), (2, 4, 6))
    faces = np.array([[1, 0, 0], [0, 2, 0], [0, 0, 3], [1, 2, 3]], float)
    assert box.contains(faces).all()
    assert not box.contains(np.nextafter(faces, np.inf)).any()


def test_a_correction_changes_what_it_states_alone() -> None:
    assert BOX.corrected(Correction()) == BOX
    moved = BOX.corrected(Correction(shift=(1, 0, 0.25)))
    assert moved == Box(BOX.kind, (21, 1, -0.35), BOX.size, BOX.heading)
    resized = BOX.corrected(Correction(size=(1, 1, 1), heading=0.0))
    assert resized == Box(BOX.kind, BOX.centre, (1, 1, 1), 0)
