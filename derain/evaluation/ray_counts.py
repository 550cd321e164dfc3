"""Counts of rays with two returns, and of second returns behind rain."""

from dataclasses import dataclass
from typing import Self

from derain.scan import Bools, Scan
from derain.views.morton import distinct_rows
from derain.views.returns import RayReturns


@dataclass(frozen=True)
class RayCounts:
    """Counts of rays that came back; rows at one position are one return.

    Attributes:
        rays: All of them.
        dual: Those with two returns or more.
        met_rain: Those whose nearest return is rain.
        given_back: Of these, those with another return behind that is not rain, which a sensor of
            one return would have lost to the drop.
    """

    rays: int
    dual: int
    met_rain: int
    given_back: int

    @classmethod
    def of(cls, scan: Scan, returns: RayReturns, rain: Bools | None = None) -> Self:
        """Counts the rays of a scan.

        Args:
            scan: The scan, of N rows; a radar's detections are of no ray.
            returns: Its returns.
            rain: True for rows of rain, bool (N,), by their labels or by a method; None where it is
                not known.
        """
        nearest = distinct_rows(scan)[0]
        if scan.radar is not None:
            nearest = nearest[~scan.radar[nearest]]
        # A farther return whose nearer return is a row, too, is counted with that row.
        nearest = nearest[~(returns.farther & (returns.partner >= 0))[nearest]]
        dual = (returns.nearer | returns.farther)[nearest]
        if rain is None:
            return cls(len(nearest), int(dual.sum()), 0, 0)
        met = nearest[rain[nearest] & ~returns.farther[nearest]]
        behind = returns.partner[met]
        given_back = (behind >= 0) & ~rain[behind]
        return cls(len(nearest), int(dual.sum()), len(met), int(given_back.sum()))

    @property
    def dual_share(self) -> float:
        """Share of the rays that have two returns or more."""
        return self.dual / max(self.rays, 1)

    @property
    def given_back_share(self) -> float:
        """Share of the rays with rain nearest that have another return behind that is not rain."""
        return self.given_back / max(self.met_rain, 1)
