"""Panes of glass."""

import numpy as np

from derain.simulation.places.walls import RETURNING, pane


def test_panes_lie_in_their_outline_and_return_the_stated_share_of_rays() -> None:
    corners = np.array([[0, 1, 0.5], [2, 1, 0.5], [2, 1, 1.5], [0, 1, 1.5]])
    shares = []
    for seed in range(200):
        triangles = pane(corners, np.random.default_rng(seed))
        assert (triangles.reshape(-1, 3) >= corners.min(axis=0) - 1e-9).all()
        assert (triangles.reshape(-1, 3) <= corners.max(axis=0) + 1e-9).all()
        edges = triangles[:, 1:] - triangles[:, :1]
        shares.append(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum() / 2 / 2)
    assert 0 < min(shares) < 3 * RETURNING[0]
    assert 0.7 * RETURNING[1] < max(shares) < 1.15 * RETURNING[1]
