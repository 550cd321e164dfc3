"""Models in another runtime, compared with the same models in onnxruntime."""

from collections.abc import Callable, Sequence
from typing import Any

from derain.errors import reason_of
from derain.export.bench.bench_entries import BenchEntry
from derain.export.bench.cost import Timing
from derain.export.runtime import Derainer
from derain.scan import Scan
from derain.sources.frame import Frame


def changes(
    methods: Sequence[BenchEntry], timing: Timing, read: Callable[[Frame], Scan]
) -> list[dict[str, Any]]:
    """Compares each model in another runtime with the same model in onnxruntime.

    Args:
        methods: The methods.
        timing: The scans to compare them on.
        read: Reads a frame, in the unit of the methods.

    Returns:
        For each such model, by the title ``method``, its ``runtime`` and the numbers of a
        :class:`derain.export.proof.Proof` as JSON-able primitives; or its ``failure``.
    """
    return [
        {
            "method": method.title,
            "runtime": str(method.runtime),
            **_change(method.usual, method, timing, read),
        }
        for method in methods
        if method.usual is not None
    ]


def _change(
    make_usual: Callable[[int], object],
    method: BenchEntry,
    timing: Timing,
    read: Callable[[Frame], Scan],
) -> dict[str, Any]:
    from derain.export.proof import compare_runtimes  # here: it loads torch

    try:
        usual, other = make_usual(timing.threads), method.ready(timing.threads)
        assert isinstance(usual, Derainer)
        assert isinstance(other, Derainer)
        # Nothing holds on to a scan while the next one is read.
        scans = ((frame.name, read(frame)) for frame in timing.frames)
        proof = compare_runtimes(usual, other, scans)
    except Exception as error:  # its row states whatever a runtime raises
        return {"failure": reason_of(error)}
    numbers = proof.as_dict()
    del numbers["cases"]
    return {**numbers, "scans": len(proof.cases)}
