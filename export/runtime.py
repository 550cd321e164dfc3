"""Runs an exported model on a CPU: NumPy, onnxruntime and the kNN library, nothing else."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from derain.cores import usable_cores
from derain.errors import InputError
from derain.probability import probability_of_rain
from derain.scan import Scan
from derain.spec import Spec
from derain.stopwatch import Stopwatch

# The one metadata key under which an exported model carries its Spec, its proof and its versions.
METADATA_KEY = "derain"


@dataclass(frozen=True, eq=False)
class Judgement:
    """What a model says of a scan, in input order.

    Attributes:
        probability: That each point is rain, float32 (N,); 0 for rows that were not judged.
        rain: True for rain, bool (N,).
        judged: True for rows that the model saw, bool (N,): not for those that cannot be judged,
            nor for points outside the grid of an image.
    """

    probability: NDArray[np.float32]
    rain: NDArray[np.bool_]
    judged: NDArray[np.bool_]


class Derainer:
    """An exported model, ready to judge scans.

    Example:
        >>> derainer = Derainer("model.onnx")  # doctest: +SKIP
        >>> clean = points[~derainer(points)]  # doctest: +SKIP

    Args:
        model: ONNX file written by ``derain export``.
        threads: Threads for view and network; 0 takes every core this process may use.

    Attributes:
        spec: How the model sees a scan and what it was trained on.
        metadata: Everything else the file says of itself: proof, versions, licence.

    Raises:
        InputError: A missing file, one that is not ONNX, or one that derain did not export; a
            negative number of threads.
    """

    def __init__(self, model: str | Path, threads: int = 0) -> None:
        if threads < 0:
            raise InputError("threads", f"{threads} is negative", "Give 0 for every core.")
        path = Path(model)
        self.threads = threads or usable_cores()
        self.session = open_session(path, self.threads)
        self.metadata = read_metadata(self.session, path)
        self.spec = Spec.from_dict(self.metadata["spec"], path)
        self.view = self.spec.make_view(self.threads)

    def __call__(
        self, points: Scan | NDArray[Any], stopwatch: Stopwatch | None = None
    ) -> NDArray[np.bool_]:
        """Says which points are rain.

        Args:
            points: A Scan, or (N, ≥ 4) numbers: x, y, z in metres and intensity in the unit of
                the training data (``spec.units``). What else a model sees (``spec.channels``) are
                columns of a Scan; the training data's mean stands in where it has none.
            stopwatch: Takes the times of the stages view, network and back.

        Returns:
            True for rain, bool (N,), in input order; False for rows that cannot be judged.
        """
        return self.judge(points, stopwatch).rain

    def probability(
        self, points: Scan | NDArray[Any], stopwatch: Stopwatch | None = None
    ) -> NDArray[np.float32]:
        """Probability that each point is rain.

        Args:
            points: As for calling the model.
            stopwatch: Takes the times of the stages view, network and back.

        Returns:
            float32 (N,), in input order; 0 for rows that cannot be judged.
        """
        return self.judge(points, stopwatch).probability

    def judge(self, points: Scan | NDArray[Any], stopwatch: Stopwatch | None = None) -> Judgement:
        """Says all that the model has to say of a scan.

        Args:
            points: As for calling the model.
            stopwatch: Takes the times of the stages view, network and back.
        """
        stopwatch = stopwatch or Stopwatch()
        scan = Scan.of(points)
        with stopwatch.stage("view"):
            view = self.view(scan)
        with stopwatch.stage("network"):
            logits = self.session.run(None, view.inputs())[0]
        with stopwatch.stage("back"):
            probability = view.back(probability_of_rain(logits))
            return Judgement(probability, probability > self.spec.threshold, view.judged)


def open_session(path: Path, threads: int) -> onnxruntime.InferenceSession:
    """Opens an ONNX file for the CPU.

    Raises:
        InputError: A missing file, or one that onnxruntime cannot read.
    """
    if not path.is_file():
        raise InputError(path, "no such file", "Give a model written by `derain export`.")
    options = onnxruntime.SessionOptions()
    # Always stated: the default counts the host's cores, not those a container may use.
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.log_severity_level = 3
    # Threads may spin while the network runs; after it, the cores are for the next scan's view.
    options.add_session_config_entry("session.force_spinning_stop", "1")
    try:
        return onnxruntime.InferenceSession(
            path.read_bytes(), options, providers=["CPUExecutionProvider"]
        )
    except Exception as error:  # onnxruntime's exceptions share no base of their own
        raise InputError(
            path,
            f"not an ONNX model that onnxruntime can run ({str(error).splitlines()[0]})",
            "Give a model written by `derain export`.",
        ) from error


def read_metadata(session: onnxruntime.InferenceSession, path: Path) -> dict[str, Any]:
    """What an exported model says of itself.

    Raises:
        InputError: A model without derain's metadata.
    """
    text = session.get_modelmeta().custom_metadata_map.get(METADATA_KEY)
    try:
        metadata = json.loads(text or "")
        if not isinstance(metadata.get("spec"), dict):
            raise ValueError("no Spec")
    except (ValueError, AttributeError) as error:
        raise InputError(
            path, "it has no Spec: derain did not export it", "Export it with `derain export`."
        ) from error
    return metadata  # type: ignore[no-any-return]
