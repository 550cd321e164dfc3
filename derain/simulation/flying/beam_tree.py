"""Which beams meet a particle, and how much of each it covers."""

from dataclasses import dataclass

import numpy as np

from derain.simulation.arrays import Columns, Floats, Ints
from derain.system.cores import sleeping_threads

with sleeping_threads():
    import small_gicp

# Beams looked up around every particle at first; where all of them meet it, more are.
FIRST_LOOK = 6
GROWTH = 5

# Pairs of a particle and a beam that are looked at in one go: 64 MB of them.
PAIRS_AT_ONCE = 2**22


@dataclass(frozen=True, eq=False)
class Meetings(Columns):
    """Which particle is met by which beam; a particle and a beam may each be in several.

    Attributes:
        particle: Row of the particle, int64 (M,).
        beam: Row of the beam, int64 (M,).
        offset: Distance of the particle's centre from the beam's axis, float64 (M,), metres.
    """

    particle: Ints
    beam: Ints
    offset: Floats


class BeamTree:
    """The beams of a sensor, to be found by their direction.

    Args:
        beams: Unit vectors along them, float64 (N, 3).
    """

    def __init__(self, beams: Floats) -> None:
        self._tree = small_gicp.KdTree(np.ascontiguousarray(beams), num_threads=1)
        self._beams = len(beams)

    def meetings(self, place: Floats, within: Floats) -> Meetings:
        """Finds the beams whose axes pass particles within some distance.

        Args:
            place: Centres of the particles, float64 (P, 3), metres, none at the origin.
            within: Distance from the axis, float64 (P,), metres.

        Returns:
            In order of the particles; the distances are chords, which for the small angles between
            neighbouring beams are the distances from the axes.
        """
        found, count = [], FIRST_LOOK
        rows = np.arange(len(place))
        while len(rows):
            count = min(count, self._beams)
            more = []
            for start in range(0, len(rows), at_once := max(PAIRS_AT_ONCE // count, 1)):
                part = rows[start : start + at_once]
                offset, beam = self._nearest(place[part], count)
                close = offset < within[part, None]
                whole = ~close[:, -1] | (count == self._beams)
                row, column = np.nonzero(close & whole[:, None])
                found.append(Meetings(part[row], beam[row, column], offset[row, column]))
                more.append(part[~whole])
            rows, count = np.concatenate(more), GROWTH * count
        return _by_particle(found)

    def nearest(self, place: Floats) -> Ints:
        """The beam whose axis passes each place nearest, int64 (P,)."""
        return self._nearest(place, 1)[1][:, 0]

    def _nearest(self, place: Floats, count: int) -> tuple[Floats, Ints]:
        """Offsets and rows of the nearest beams, nearest first, float64 and int64 (P, count)."""
        far = np.linalg.norm(place, axis=1, keepdims=True)
        # One thread, so that beams at the same distance come in the same order every time.
        beam, squared = self._tree.batch_knn_search(place / far, count, num_threads=1)
        return np.sqrt(squared) * far, beam.astype(np.int64)


def covered_share(beam: Floats, particle: Floats, offset: Floats) -> Floats:
    """Share of a beam's cross-section that a particle covers, float64 (M,), in 0..1.

    The area of the lens in which two discs overlap, over that of the first.

    Args:
        beam: Width of the beam where the particle is, float64 (M,), metres.
        particle: Its diameter, float64 (M,), metres.
        offset: Distance between their centres, float64 (M,), metres.
    """
    wide, narrow = np.maximum(beam, particle) / 2, np.minimum(beam, particle) / 2
    # Beyond these bounds the smaller disc is inside or outside the other as a whole.
    apart = np.clip(offset, wide - narrow, wide + narrow)
    with np.errstate(divide="ignore", invalid="ignore"):
        toward_wide = np.nan_to_num((apart**2 + wide**2 - narrow**2) / (2 * apart * wide), nan=1)
        toward_narrow = np.nan_to_num((apart**2 + narrow**2 - wide**2) / (2 * apart * narrow))
    kite = (wide + narrow) ** 2 - apart**2, apart**2 - (wide - narrow) ** 2
    lens = (
        wide**2 * np.arccos(np.clip(toward_wide, -1, 1))
        + narrow**2 * np.arccos(np.clip(toward_narrow, -1, 1))
        - np.sqrt(np.maximum(kite[0] * kite[1], 0)) / 2
    )
    lens = np.where(offset <= wide - narrow, np.pi * narrow**2, lens)
    return np.asarray(np.clip(lens / (np.pi * (beam / 2) ** 2), 0, 1))


def _by_particle(parts: list[Meetings]) -> Meetings:
    none = Meetings(np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0))
    meetings = Meetings.joined([none, *parts])
    return meetings.take(np.argsort(meetings.particle, kind="stable"))
