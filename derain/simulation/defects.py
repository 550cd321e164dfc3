"""Defects of a scan besides noise: lost and copied returns, range steps, mixed points.

Every return keeps its label: no return becomes rain, and no rain becomes something else. A point
between two surfaces gets the label of the nearer one.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from derain.scan import Bools, Floats, Ints
from derain.simulation.arrays import Returns
from derain.simulation.classes import TrackClass, unpacked
from derain.simulation.settings import Settings, Share

# Parts of a scan that are lost together: sensors send a scan in 75 (Ouster) to 180 (Velodyne)
# packets, and a network drops some of them in a row.
SECTORS_OF_A_SCAN = 60

# Two neighbouring returns nearer together than this are of one surface, metres.
SMALLEST_GAP = 0.3


@dataclass(frozen=True)
class Defects(Settings):
    """The defects of a sensor's scans; none by default.

    Attributes:
        dropped: Share of the returns that are lost, each by itself.
        dropped_rows: Share of the rows of beams that are lost, anew in each scan.
        dropped_sectors: Share of the sectors, all columns sent in a sixtieth of a scan, that are
            lost, anew in each scan.
        mixed: Share of the beams at the border of two surfaces that see both. Where these are no
            farther apart than ``merging``, one point comes back from anywhere in between; else a
            sensor of dual returns reports both. The border is between a beam and the next of its
            row, as beams are smeared along the row.
        merging: Distance of two surfaces within which a sensor takes them for one, metres.
        range_step: Distances are multiples of it, metres; 0 for any distance.
        copies: Share of the beams with a single return that report it twice: two rows of the scan
            are the same. A dual sensor with equal returns copies all of them.

    Raises:
        InputError: A value that is impossible.
    """

    SUBJECT = "defects"
    dropped: Share = 0.0
    dropped_rows: Share = 0.0
    dropped_sectors: Share = 0.0
    mixed: Share = 0.0
    merging: float = 2.0
    range_step: float = 0.0
    copies: Share = 0.0

    def at_borders(
        self, returns: Returns, columns: int, *, dual: bool, generator: Generator
    ) -> Returns:
        """Lets beams at the border of two surfaces return both, or what lies in between.

        Args:
            returns: Detected returns.
            columns: Beams per row of the sensor.
            dual: True if it reports two returns of a beam.
            generator: Random generator.

        Returns:
            The same with other ranges, and with second rows of beams that return both.
        """
        if not self.mixed:
            return returns
        row, beside = _borders(returns, columns)
        chosen = generator.random(len(row)) < self.mixed
        row, beside = row[chosen], beside[chosen]
        share = generator.random(len(row))  # of the light that goes past the beam's own surface
        apart = np.abs(returns.range[beside] - returns.range[row]) > self.merging
        merged = _merged(returns, row[~apart], beside[~apart], share[~apart])
        if not dual:
            return merged
        return _with_second_returns(merged, row[apart], returns.take(beside[apart]), share[apart])

    def received(self, returns: Returns, shape: tuple[int, int], generator: Generator) -> Bools:
        """True for returns that are not lost, bool (N,).

        Args:
            returns: Detected returns.
            shape: Rows of the sensor and beams per row.
            generator: Random generator.
        """
        rows, columns = shape
        lost = np.zeros(len(returns.beam), bool)
        if self.dropped:
            lost |= generator.random(len(lost)) < self.dropped
        if self.dropped_rows:
            lost |= (generator.random(rows) < self.dropped_rows)[returns.beam // columns]
        if self.dropped_sectors:
            sector = returns.beam % columns * SECTORS_OF_A_SCAN // columns
            lost |= (generator.random(SECTORS_OF_A_SCAN) < self.dropped_sectors)[sector]
        return np.asarray(~lost, np.bool_)

    def stepped(self, range: Floats) -> Floats:
        """Distances in metres, float64 (N,), rounded to the step of the sensor."""
        return np.round(range / self.range_step) * self.range_step if self.range_step else range

    def reported(self, beam: Ints, generator: Generator) -> Ints:
        """Rows of a scan with its copies, int64 (M,): a row that is reported twice comes twice.

        Args:
            beam: Beam of every row of the scan, int64 (N,), ascending.
            generator: Random generator.
        """
        if not self.copies:
            return np.arange(len(beam))
        single = _single(beam) & (generator.random(len(beam)) < self.copies)
        return np.repeat(np.arange(len(beam)), 1 + single)


def _single(beam: Ints) -> Bools:
    """True if each row is the only one of its beam, bool (N,), beams ascending."""
    changes = np.diff(beam, prepend=-1, append=-1) != 0
    return np.asarray(changes[1:] & changes[:-1])


def _borders(returns: Returns, columns: int) -> tuple[Ints, Ints]:
    """Rows of the beams at a border, int64 (B,), and of the next beam in each one's row.

    Both beams return one surface each. Beams with rain are left out: the simulation of rain already
    decides what a drop shares a beam with.
    """
    kind, _ = unpacked(returns.label)
    surface = returns.returned & (kind != TrackClass.RAIN) & _single(returns.beam)
    next_in_row = (np.diff(returns.beam) == 1) & (returns.beam[1:] % columns != 0)
    gap = np.abs(np.diff(returns.range)) > SMALLEST_GAP
    row = np.flatnonzero(next_in_row & gap & surface[:-1] & surface[1:])
    return row, row + 1


def _merged(returns: Returns, row: Ints, beside: Ints, share: Floats) -> Returns:
    """Moves rows towards the range of the beams beside them by a share of the way."""
    nearer = np.where(returns.range[row] <= returns.range[beside], row, beside)
    columns = returns.range.copy(), returns.reflectivity.copy(), returns.label.copy()
    for column in columns[:2]:
        column[row] += share * (column[beside] - column[row])
    columns[2][row] = returns.label[nearer]
    return Returns(*columns, returns.beam)


def _with_second_returns(returns: Returns, row: Ints, second: Returns, share: Floats) -> Returns:
    """Adds a second return to the beams of some rows; the two returns share the beam's power."""
    first = returns.reflectivity.copy()
    first[row] *= 1 - share
    second = replace(second, reflectivity=share * second.reflectivity, beam=returns.beam[row])
    joined = Returns.joined([replace(returns, reflectivity=first), second])
    added = len(returns.beam) + np.arange(len(row))
    weaker = joined.power[added] <= joined.power[row]  # and so comes after the other
    return joined.take(np.insert(np.arange(len(returns.beam)), row + weaker, added))
