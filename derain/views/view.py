"""The base class of views: conversion of a scan to a network's input, and back-projection."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Self

from derain.errors import InputError
from derain.files.documents import Entry
from derain.scan import Array, Bools, Float32s, Ints, Scan
from derain.system.registry import Registry
from derain.views.candidates import Candidates
from derain.views.channels import Channels, FillValues
from derain.views.spherical_grid import ALL_AROUND, Extent

# In a target: nothing is there to be judged, such as in a pixel without a return.
IGNORED = -1

# Carries scores of a view's cells, float32 (M,), to the rows of its scan, float32 (N,).
BackProjection = Callable[[Float32s], Float32s]


class ViewedScan(ABC):
    """One scan as a network sees it, in cells: points of a neighbour view, pixels of an image."""

    @property
    def varying(self) -> Mapping[str, str]:
        """Inputs whose first axis is longer in some scans than in others, and what is on it.

        Inputs that have the same things on it are equally long. By default there are none: the
        inputs of all scans have one size.
        """
        return {}

    @property
    @abstractmethod
    def size(self) -> int:
        """M, the number of cells that the network scores."""

    @property
    @abstractmethod
    def judged(self) -> Bools:
        """True for rows of the scan that are given the score of some cell, bool (N,)."""

    @abstractmethod
    def inputs(self) -> dict[str, Array]:
        """The network's inputs by name, in its order."""

    @abstractmethod
    def target(self, rain: Bools) -> Ints:
        """Training target of each cell.

        Args:
            rain: Truth for every row of the scan, bool (N,).

        Returns:
            1 for rain, 0 for everything else, ``IGNORED`` where nothing is to be judged,
            int64 (M,).
        """

    @abstractmethod
    def back_projection(self) -> BackProjection:
        """Back-projection of scores to the scan's rows, without the inputs, which may be freed."""

    def back(self, score: Float32s) -> Float32s:
        """Carries the network's scores back to every row of the scan.

        Args:
            score: One value per cell, float32 (M,).

        Returns:
            One value per row of the scan in its order, float32 (N,); 0 for rows that are not
            ``judged``, or that the view's candidates leave out.
        """
        return self.back_projection()(score)

    @staticmethod
    @abstractmethod
    def pack(seen: Sequence[Any]) -> dict[str, Array]:
        """The inputs of several scans of this kind as one batch."""


class View(ABC):
    """Converts a scan into a network's input; the same in training and in deployment.

    A view enters derain by its file in ``derain/views``, or by an entry point ``derain.views`` of
    another package, and the decorator that gives it its name::

        @VIEWS.add("neighbours")
        class NeighbourView(View): ...

    Attributes:
        NAME: Its name in a Spec; the decorator sets it.
        WEIGHS_INTENSITY: True if it shows how bright points are, whatever the channels.
    """

    NAME: ClassVar[str]
    WEIGHS_INTENSITY: ClassVar[bool] = False

    @classmethod
    @abstractmethod
    def of(cls, entry: Entry, channels: Channels, fill_value: FillValues, threads: int) -> Self:
        """Reads back what :meth:`as_dict` gave. It is not trusted.

        Args:
            entry: The entry ``view`` of a Spec.
            channels: The network's input channels, in order, as :meth:`Scan.channel` names it.
            fill_value: Replacement of a value that a scan lacks, by channel.
            threads: Threads that it may use; 0 takes every core this process may use.

        Raises:
            InputError: Something that does not describe it.
        """

    @abstractmethod
    def as_dict(self) -> dict[str, Any]:
        """Its part of a Spec, JSON-able: its name as ``kind``, and what is its own."""

    @property
    def azimuth(self) -> Extent:
        """Its field of view: right and left bound, degrees counter-clockwise from x.

        By default everything around.
        """
        return ALL_AROUND

    def with_candidates(self, candidates: Candidates) -> "View":
        """The same view with cells for candidates alone; all other points are given score 0.

        The network's score of a candidate must not change: all inputs that it depends on stay in
        the view. A view without candidates refuses, as this one does.

        Args:
            candidates: Points that may be rain.

        Raises:
            InputError: A view that sees every point alike.
        """
        remedy = "Use the model without candidates."
        raise InputError(self.NAME, "the view cannot leave points out", remedy)

    @abstractmethod
    def __call__(self, scan: Scan) -> ViewedScan:
        """Views a scan."""


# Every view, by the name that it has in a Spec.
VIEWS: Registry[type[View]] = Registry("derain.views", base="View")
