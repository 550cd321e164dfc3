"""What a sensor of two returns would record, and which of its returns are of one ray."""

import numpy as np

from derain.scan import Bools, Ints
from derain.simulation.sensor import unit_vectors
from derain.views.return_columns import LEAST_APART


class Recording:
    """What a sensor of two returns sees, and which of its returns are of one ray.

    Attributes:
        xyz: float32 (N, 3), metres, the rows shuffled.
        ray: Number of the ray of each row, int64 (N,).
        distance: What the sensor measured of each row, float64 (N,), metres.
        two: Whether the row's ray has two returns, bool (N,).
    """

    def __init__(self, seed: int, share: float = 0.2, step: float = 0.3, beams: int = 12) -> None:
        generator = np.random.default_rng(seed)
        azimuth = np.arange(-180, 180, step)
        directions = np.stack(np.meshgrid(azimuth, np.linspace(-20, 20, beams)), axis=-1)
        directions = directions.reshape(-1, 2)
        directions += generator.normal(0, step / 50, directions.shape)
        near = generator.uniform(1, 30, len(directions))
        behind = near + generator.uniform(2 * LEAST_APART, 50, len(near))
        second = np.flatnonzero(generator.random(len(near)) < share)
        ray = np.concatenate([np.arange(len(near)), second])
        order = generator.permutation(len(ray))
        self.ray = ray[order]
        self.distance = np.concatenate([near, behind[second]])[order]
        self.two = np.isin(self.ray, second)
        unit = unit_vectors(*directions[self.ray].T)
        self.xyz = (unit * self.distance[:, None]).astype(np.float32)

    def truth(self) -> tuple[Ints, Bools, Bools]:
        """Row of the other return of each row's ray, and which are the nearer and the farther."""
        order = np.lexsort((self.distance, self.ray))
        first = np.flatnonzero(self.ray[order][1:] == self.ray[order][:-1])
        near, far = order[first], order[first + 1]
        partner = np.full(len(self.ray), -1)
        partner[near], partner[far] = far, near
        rows = np.arange(len(self.ray))
        return partner, np.isin(rows, near), np.isin(rows, far)
