"""The label-free teacher of 3D-UnOutDet."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from derain.filters.point_filter import FILTERS, TUNED_NEIGHBOURS, PointFilter
from derain.scan import Bools, Scan
from derain.views.neighbours import Neighbourhoods
from derain.views.scan_issues import ScanIssue, intensity_of_another_scale, missing_intensity


@FILTERS.add("ssr")
@dataclass(frozen=True)
class SSR(PointFilter):
    """Calls a point rain if its whole neighbourhood is dim for how far apart it lies.

    Rain where √k · ‖intensity · (distance + 1)²‖₂ < ``threshold``, over the k points of the
    neighbourhood, distances being those to the point, in metres. That is the norm of the
    spectrum of these k numbers, which the authors compute. Where the scan has fewer points, k is
    their number. Without intensity, nothing is found.

    Example:
        >>> scan = derain.read_scan("scan.bin")  # a wall of 800 points and 20 drops before it
        >>> rain = derain.FilterDerainer(SSR())(scan)
        >>> int(rain.sum()), bool((scan.range[rain] < 15).all())
        (20, True)

    Attributes:
        neighbours: k, the size of a neighbourhood, the point itself included.
        threshold: In the unit of intensity; 2.5 is for WADS, whose intensities are 0..255.
        FULL_SCALE: Of the intensities that the threshold is for, as published.

    Source: 3D-UnOutDet, github.com/sporsho/3DUnOutDet, dataset/unsupervised; by Parseval's theorem
        its norm after a Fourier transform is √k times that before.
    """

    HELP = "rain is dim, and so are its neighbours, in relation to their distances"
    SPACE: ClassVar = {"neighbours": TUNED_NEIGHBOURS, "threshold": (0.01, 1e6)}
    FULL_SCALE = 255.0

    neighbours: int = 9
    threshold: float = 2.5

    def judge(self, view: Neighbourhoods) -> Bools:
        """Returns which points are rain; see :class:`PointFilter`.

        Args:
            view: One scan; its intensities are not numbers where it has none.
        """
        k = min(self.neighbours, view.size)
        intensity = view.points[:, 3].astype(np.float64)
        energy = np.zeros(view.size)
        for neighbour, distance in zip(
            view.neighbours.T[:k], view.distances.T[:k].astype(np.float64), strict=True
        ):
            energy += np.square(intensity[neighbour] * np.square(distance + 1))
        return math.sqrt(k) * np.sqrt(energy) < self.threshold

    def issues(self, scan: Scan) -> Iterator[ScanIssue]:
        """Warnings about a scan: no intensity, or one in another unit than the threshold's."""
        yield from missing_intensity(scan)
        yield from intensity_of_another_scale(scan, self.FULL_SCALE, self.name)
