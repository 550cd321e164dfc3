"""One method of a bench: what it is called, how it is made, and what it is."""

import pickle
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.export.bench.other_runtime import OtherRuntime
from derain.filters import PointFilter
from derain.scan import Scan
from derain.system.stopwatch import Stopwatch
from derain.views.candidates import Candidates
from derain.views.oddities import Examiner

# Judges a scan, bool (N,), and gives the stopwatch its stages.
TimedMethod = Callable[[Scan, Stopwatch], NDArray[np.bool_]]

# Name of the fact that says how many bytes the file of a method has.
FILE_SIZE = "file_bytes"


@dataclass(frozen=True)
class Contestant:
    """One row of a bench.

    Attributes:
        title: What the row is called; no two have the same.
        kind: Name of its network, filter or baseline.
        ready: Makes the method, with a number of threads.
        facts: What the method is, for whoever repeats the bench: file or parameters.
        filter: The filter, where it is one: filters share one search for neighbours.
        candidates: Bounds outside which that filter calls nothing rain, if it has any.
        judges_by: What it judges by, as far as a scan may not suit it.
        by_other: What runs it, where it is a model and that is not onnxruntime in float32.
    """

    title: str
    kind: str
    ready: Callable[[int], TimedMethod]
    facts: dict[str, Any] = field(default_factory=dict)
    filter: PointFilter | None = None
    candidates: Candidates | None = None
    judges_by: Examiner | None = None
    by_other: OtherRuntime | None = None

    @cached_property
    def can_be_sent(self) -> bool:
        """Whether another process can be given it.

        What cannot be pickled cannot, nor can what the user's own script or session defines: no
        other process knows of it.
        """
        try:
            return b"__main__" not in pickle.dumps(self.ready)
        except Exception:  # each object that cannot be pickled says so in its own way
            return False
