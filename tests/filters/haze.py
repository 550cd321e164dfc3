"""A filter of another package, in one file: all that there is to know of it, and nothing else."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from derain.filters import FILTERS, PointFilter, Span
from derain.scan import Scan
from derain.views.neighbours import Neighbourhoods
from derain.views.scan_issues import ScanIssue


@FILTERS.add("haze")
@dataclass(frozen=True)
class Haze(PointFilter):
    """Calls a point rain if it is near the sensor, and no other point is near it."""

    HELP: ClassVar[str] = "rain is near the sensor and has no other point near it"
    SPACE: ClassVar[Mapping[str, Span]] = {"neighbours": (2, 20), "reach": (1.0, 100.0)}

    neighbours: int = 2
    reach: float = 30.0
    spacing: float = 0.5

    def judge(self, view: Neighbourhoods) -> NDArray[np.bool_]:
        near = np.linalg.norm(view.points[:, :3], axis=1) < self.reach
        return near & (view.distances[:, self.neighbours - 1] > self.spacing)

    def issues(self, scan: Scan) -> Iterator[ScanIssue]:
        if not (scan.range[scan.valid] < self.reach).any():
            yield ScanIssue("nothing near", f"no point is nearer than {self.reach:g} m")
