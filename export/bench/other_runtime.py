"""Models in another runtime, compared with the same models in onnxruntime."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from derain.errors import InputError, reason_of
from derain.export.runtime import Derainer
from derain.export.runtimes.registry import Runtime
from derain.scan import Scan
from derain.spec import Spec

if TYPE_CHECKING:
    from derain.export.bench.bench_entries import BenchEntry, TimedMethod
    from derain.export.bench.cost import Timing
    from derain.sources.frame import Frame


@dataclass(frozen=True)
class OtherRuntime:
    """A runtime of a model in place of onnxruntime.

    Attributes:
        runtime: The runtime.
        usual: Makes the same model in onnxruntime in float32, with a number of threads.
    """

    runtime: Runtime
    usual: Callable[[int], object]

    @property
    def facts(self) -> dict[str, Any]:
        """The runtime, from which the bench can be repeated."""
        return {"runtime": str(self.runtime)}  # one text, because precision is also a score


def with_runtime_variants(rows: Sequence["BenchEntry"], runtime: Runtime) -> list["BenchEntry"]:
    """The methods, each model followed by the same in another runtime.

    Args:
        rows: The methods.
        runtime: The other runtime; the default one adds nothing.

    Raises:
        InputError: A runtime that cannot run one of the models, or no model.
    """
    if runtime.is_default:
        return list(rows)
    beside = []
    for row in rows:
        beside.append(row)
        if isinstance(row.spec_or_filter, Spec) and row.by_other is None:
            beside.append(replace(with_runtime(row, runtime), title=f"{row.title} ({runtime})"))
    if len(beside) == len(rows):
        raise InputError(f"runtime {runtime}", "none of the methods is a model", "Leave it out.")
    return beside


def with_runtime(row: "BenchEntry", runtime: Runtime) -> "BenchEntry":
    """A model in another runtime.

    Args:
        row: The model in the default one.
        runtime: The other runtime.

    Raises:
        InputError: It cannot run the model.
    """
    make: Callable[..., TimedMethod] = row.ready  # a model's takes a runtime
    ready = partial(make, runtime=runtime)
    ready(1)  # refused before any work
    other = OtherRuntime(runtime, row.ready)
    return replace(row, ready=ready, facts={**row.facts, **other.facts}, by_other=other)


def changes(
    methods: Sequence["BenchEntry"], timing: "Timing", read: Callable[["Frame"], Scan]
) -> list[dict[str, Any]]:
    """Compares each model in another runtime with the same model in onnxruntime.

    Args:
        methods: The methods.
        timing: The scans to compare them on.
        read: Reads a frame, in the unit of the methods.

    Returns:
        For each such model, by the title ``method``, the numbers of a
        :class:`derain.export.proof.Proof` as JSON-able primitives; or its ``failure``.
    """
    return [
        {"method": method.title, **method.by_other.facts, **_change(method, timing, read)}
        for method in methods
        if method.by_other is not None
    ]


def _change(
    method: "BenchEntry", timing: "Timing", read: Callable[["Frame"], Scan]
) -> dict[str, Any]:
    from derain.export.proof import (
        compare_runtimes,  # here: it loads torch, whose memory is not measured
    )

    assert method.by_other is not None
    try:
        usual, other = method.by_other.usual(timing.threads), method.ready(timing.threads)
        assert isinstance(usual, Derainer)
        assert isinstance(other, Derainer)
        # A map releases each scan before the next is read.
        proof = compare_runtimes(usual, other, map(_named(read), timing.frames))
    except Exception as error:  # its row states whatever a runtime raises
        return {"failure": reason_of(error)}
    numbers = proof.as_dict()
    del numbers["cases"]
    return {**numbers, "scans": len(proof.cases)}


def _named(read: Callable[["Frame"], Scan]) -> Callable[["Frame"], tuple[str, Scan]]:
    return lambda frame: (frame.name, read(frame))
