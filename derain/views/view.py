"""What every view of a scan can do: be a network's input, and carry its scores back."""

from collections.abc import Callable, Sequence
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from derain.scan import Scan

# In a target: nothing is there to be judged, such as in a pixel without a return.
IGNORED = -1

# Carries scores of a view's cells, float32 (M,), to the rows of its scan, float32 (N,).
WayToRows = Callable[[NDArray[np.float32]], NDArray[np.float32]]


class ViewedScan(Protocol):
    """One scan as a network sees it, in cells: points of a neighbour view, pixels of an image.

    Attributes:
        VARYING: Name of the inputs' first axis where it is as long as the scan is; None where the
            inputs of all scans have one size.
    """

    VARYING: ClassVar[str | None]

    @property
    def size(self) -> int:
        """M, the number of cells that the network scores."""

    @property
    def judged(self) -> NDArray[np.bool_]:
        """True for rows of the scan that some cell answers for, bool (N,)."""

    def inputs(self) -> dict[str, NDArray[Any]]:
        """The network's inputs by name, in its order."""

    def target(self, rain: NDArray[np.bool_]) -> NDArray[np.int64]:
        """What the network is to say of each cell.

        Args:
            rain: Truth for every row of the scan, bool (N,).

        Returns:
            1 for rain, 0 for everything else, ``IGNORED`` where nothing is to be judged,
            int64 (M,).
        """

    def back(self, score: NDArray[np.float32]) -> NDArray[np.float32]:
        """Carries scores of the cells, float32 (M,), to the scan's rows, float32 (N,)."""

    def way_to_rows(self) -> WayToRows:
        """What :meth:`back` does, without the inputs: what is needed once they were scored."""

    @staticmethod
    def pack(views: Sequence[Any]) -> dict[str, NDArray[Any]]:
        """The inputs of several scans as one batch."""


class View(Protocol):
    """How a scan becomes a network's input; the same in training and in deployment.

    Attributes:
        KIND: Its name in a Spec.
    """

    KIND: ClassVar[str]

    @property
    def azimuth(self) -> tuple[float, float]:
        """What it sees: right and left bound, degrees counter-clockwise from x."""

    def __call__(self, scan: Scan) -> ViewedScan:
        """Views a scan."""
