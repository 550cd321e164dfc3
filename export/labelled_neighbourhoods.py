"""What filters see of a labelled scan, found once for all trials of their parameters."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.cards.card import DataCard
from derain.filters import filter_view
from derain.scan import Scan
from derain.views.candidates import Candidates
from derain.views.neighbours import Neighbourhoods


@dataclass(frozen=True, eq=False)
class LabelledNeighbourhoods:
    """What filters see of a scan, and its truth: found once, and judged in every trial.

    Attributes:
        view: Its neighbourhoods, M points with as many neighbours as any trial looks at.
        rain: Points of rain, bool (M,).
        solid: Points of what is not rain, bool (M,). Points whose class is not known are neither.
        candidate: Points that may be called rain, bool (M,).
    """

    view: Neighbourhoods
    rain: NDArray[np.bool_]
    solid: NDArray[np.bool_]
    candidate: NDArray[np.bool_]

    @classmethod
    def of(
        cls,
        scan: Scan,
        card: DataCard,
        neighbours: int,
        threads: int,
        candidates: Candidates | None = None,
    ) -> "LabelledNeighbourhoods":
        """Finds the neighbours of a labelled scan's distinct valid positions.

        Args:
            scan: The scan.
            card: Says which of its labels are rain.
            neighbours: How many of each point, the point itself included; see
                :func:`derain.export.tuning.neighbours_to_find`.
            threads: Threads of the search; 0 takes every core this process may use.
            candidates: Bounds outside which nothing is called rain; None where anything may be.

        Raises:
            InputError: A scan without labels.
        """
        view = filter_view(neighbours, threads)(scan)
        rain, unknown = card.rain_of(scan)[view.first], card.unknown_of(scan)[view.first]
        among = np.ones(len(scan), bool) if candidates is None else candidates.among(scan)
        return cls(view, rain, ~(rain | unknown), among[view.first])
