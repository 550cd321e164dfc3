"""Runs an exported model on a CPU: NumPy, one runtime and the kNN library, nothing else."""

import os
from collections.abc import Iterator
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any, Self

import numpy as np

from derain.default import DEFAULT, default_model
from derain.errors import InputError
from derain.export.model_file import METADATA_KEY, ModelFile
from derain.export.runtimes.session import (
    DEFAULT_RUNTIME,
    FLOAT32_PRECISION,
    Runtime,
    Session,
    TensorType,
)
from derain.scan import Array, Bools, Float32s, Scan
from derain.sources.judgement import Judgement
from derain.sources.method import ScanMethod
from derain.system.cores import threads_of
from derain.system.stopwatch import Stopwatch
from derain.views.probability import probability_of_rain
from derain.views.scan_issues import ScanIssue, intensity_in_places, outside_view
from derain.views.view import View, ViewedScan

__all__ = ["METADATA_KEY", "Derainer", "Judgement"]


class Derainer(ScanMethod):
    """An exported model, ready to judge scans.

    Example:
        >>> points = np.fromfile("scan.bin", np.float32).reshape(-1, 4)  # x, y, z, intensity
        >>> derainer = Derainer("model.onnx")
        >>> clean = points[~derainer(points)]
        >>> derainer.spec.network, derainer.probability(points).shape
        ('outdet', (820,))
        >>> clean = points[~Derainer()(points)]  # by the model that comes with derain

    Args:
        model: ONNX file written by ``derain export``; None, or ``default``, takes the model that
            comes with derain, which ``derain info default`` describes.
        threads: Threads for view and network; 0 takes every core this process may use.
        runtime: Runtime of the network: ``onnxruntime``, or ``openvino``, which has to be installed
            (``pip install 'derain[openvino]'``).
        precision: Precision of computation: ``float32``, or ``bf16`` with OpenVINO on a processor
            that has it. Some scores near the threshold then come out on its other side.

    Attributes:
        path: Its file.
        name: Its name in commands: the file, or ``default``.
        threads: Number of threads that it uses.
        runtime: Runtime of the network, and its precision.
        spec: The model's view, channels and training data.
        metadata: Everything else in the file's metadata: proof, versions, licence.

    Raises:
        InputError: A missing file, one that is not ONNX, one that derain did not export or that
            has changed since; a filter, or its name; threads that are no number from 0 on; a
            runtime that there is not or that is not installed, or a precision that it or the
            processor has not.
    """

    def __init__(
        self,
        model: str | Path | None = None,
        threads: int = 0,
        runtime: str = DEFAULT_RUNTIME,
        precision: str = FLOAT32_PRECISION,
    ) -> None:
        self.runtime = Runtime(runtime, precision)
        of_derain = model is None or str(model) == DEFAULT
        file = ModelFile.read(default_model() if of_derain else _path_of(model))
        self.path = file.path
        self.name = DEFAULT if of_derain else str(file.path)
        self.threads = threads_of(threads)
        self.metadata, self.spec = file.metadata, file.spec
        self._checksum = sha256(file.content).hexdigest()
        self.view = self.spec.make_view(self.threads)
        self.session = self.runtime.open(file, self.threads)
        _refuse_other_network(self.session, self.view, self.path)

    def __call__(self, points: Scan | Array, stopwatch: Stopwatch | None = None) -> Bools:
        """Returns which points are rain.

        Args:
            points: A Scan, or (N, ≥ 4) numbers: x, y, z in metres and intensity in the unit of
                the training data (``spec.units``). What else a model sees (``spec.channels``) are
                columns of a Scan; the training data's mean stands in where it has none.
            stopwatch: Takes the times of the stages view, network and back.

        Returns:
            True for rain, bool (N,), in input order; False for rows that cannot be judged, or that
            the model's candidates leave out. A model of cues judges points of no possible
            intensity as in a scan without intensities.
        """
        return self.judge(points, stopwatch).rain

    def probability(self, points: Scan | Array, stopwatch: Stopwatch | None = None) -> Float32s:
        """Probability that each point is rain.

        Args:
            points: As for calling the model.
            stopwatch: Takes the times of the stages view, network and back.

        Returns:
            float32 (N,), in input order; 0 for rows that cannot be judged, or that the model's
            candidates leave out.

        Raises:
            InputError: A network that fails, or whose scores are not finite.
        """
        return self.judge(points, stopwatch).probability

    def judge(self, points: Scan | Array, stopwatch: Stopwatch | None = None) -> Judgement:
        """Judges a scan: which points are rain, and how probably.

        Args:
            points: As for calling the model.
            stopwatch: Takes the times of the stages view, network and back.

        Raises:
            InputError: A network that fails, or whose scores are not finite.
        """
        return self.with_warnings(self.judge_silently(points, stopwatch))

    def judge_silently(self, points: Scan | Array, stopwatch: Stopwatch | None = None) -> Judgement:
        """As :meth:`judge`, without warnings."""
        scan, stopwatch = Scan.of(points), stopwatch or Stopwatch()
        judgement = self._judged(scan, stopwatch)
        dark = scan.lacks_intensity
        if not (self.view.WEIGHS_INTENSITY and dark.any()):
            return judgement
        blank = replace(scan, intensity=None)
        of_blank = self._judged(blank, stopwatch)
        probability = np.where(dark, of_blank.probability, judgement.probability)
        rain = np.where(dark, of_blank.rain, judgement.rain)
        return Judgement(probability, rain, judgement.judged | dark, scan)

    def fingerprint(self) -> str:
        """A fingerprint of its file as it was read, its threshold and its runtime."""
        settings = f"{self.spec.threshold} {self.runtime.name} {self.runtime.precision}"
        return sha256(f"{self._checksum} {settings}".encode()).hexdigest()[:16]

    def issues(self, judgement: Judgement) -> Iterator[ScanIssue]:
        """Warnings about a scan for the model, and whether much of it lies outside its grid."""
        yield from intensity_in_places(judgement.scan, judgement.judged)
        yield from self.spec.issues(judgement.scan)
        if "grid" in self.spec.view:
            yield from outside_view(judgement.scan, judgement.judged, self.spec.data)

    def as_dict(self) -> dict[str, Any]:
        """The model's name, and its threshold."""
        return {"method": self.name, "threshold": self.spec.threshold}

    def __reduce__(self) -> tuple[type[Self], tuple[Any, ...], dict[str, Any]]:
        # A runtime's session cannot be pickled: a copy, as in another process, reads the file anew.
        options = (self.name, self.threads, self.runtime.name, self.runtime.precision)
        return type(self), options, {"spec": self.spec, "warns": self.warns}

    def logits(self, view: ViewedScan) -> Float32s:
        """Scores of "not rain" and "rain" of the M cells of a view, float32 (M, 2).

        Raises:
            InputError: A network that fails.
        """
        try:
            return self.session.run(view.inputs())
        except Exception as error:  # the runtimes' exceptions share no base of their own
            raise InputError(
                self.path, f"its network fails ({error})", "Export it with `derain export`."
            ) from error

    def _judged(self, scan: Scan, stopwatch: Stopwatch) -> Judgement:
        with stopwatch.stage("view"):
            view = self.view(scan)
        with stopwatch.stage("network"):
            logits = self.logits(view)
            self._check_scores(logits, view, scan)
        with stopwatch.stage("back"):
            probability = view.back(probability_of_rain(logits))
            rain = probability > self.spec.threshold
        return Judgement(probability, rain, view.judged, scan)

    def _check_scores(self, logits: Float32s, view: ViewedScan, scan: Scan) -> None:
        """Refuses scores that would count as "not rain" because nothing compares with them."""
        if logits.shape != (view.size, 2) or not np.isfinite(logits).all():
            raise InputError(
                self.path,
                f"its scores of {scan.name or 'a scan'} are not one finite pair for each of "
                f"{view.size:,} cells",
                "Export the model again; if other models fail on the scan too, check its values.",
            )


def _path_of(model: object) -> Path:
    """The path of a model.

    Raises:
        InputError: Something else, such as a filter or the name of one.
    """
    if isinstance(model, str | Path) and (Path(model).suffix or os.path.exists(model)):
        return Path(model)
    raise InputError(
        str(model),
        "it is not a model",
        "Give the path of an ONNX file; derain.FilterDerainer calls a filter such as "
        "derain.DROR(), derain.PersistenceDerainer a recording.",
    )


def _refuse_other_network(session: Session, view: View, path: Path) -> None:
    """Refuses a graph that takes or gives anything but what its Spec's view does.

    Raises:
        InputError: Other names, types or shapes.
    """
    empty = view(Scan.of(np.zeros((0, 4))))
    varying = empty.varying
    wanted = {
        name: (array.dtype.name, array.shape[name in varying :])
        for name, array in empty.inputs().items()
    }
    found = {name: _beyond(value, name in varying) for name, value in session.inputs.items()}
    if session.DROPS_UNUSED_INPUTS:
        wanted = {name: kind for name, kind in wanted.items() if name in found}
    scores = [_beyond(value, 1) for value in session.outputs]
    if found != wanted or scores != [("float32", (2,))]:
        raise InputError(
            path,
            f"its network takes {found} and returns {scores}, where its Spec requires {wanted} and "
            "two scores",
            "Export it with `derain export`.",
        )


def _beyond(value: TensorType, axes: int) -> tuple[str, tuple[int | None, ...]]:
    """Type and sizes of what a network takes or gives, without its first axes."""
    return value.dtype, value.shape[axes:]
