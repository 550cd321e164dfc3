"""The start of a training that a user may name: a checkpoint."""

from pathlib import Path

from derain.default import DEFAULT, default_checkpoint
from derain.errors import InputError

START_HELP = f"begin from the weights of a trained model: a checkpoint, or {DEFAULT}"


def checkpoint_of(start: str) -> Path:
    """The checkpoint of the model that a user names.

    Args:
        start: A checkpoint, or ``default``.

    Raises:
        InputError: An ONNX file, whose weights are folded for deployment: no training goes on from
            them.
    """
    if start == DEFAULT:
        return default_checkpoint()
    if Path(start).suffix == ".onnx":
        raise InputError(
            start,
            "no training goes on from an ONNX file, whose weights are folded",
            "Give its checkpoint: student.ckpt in the folder of `derain learn`, or best.ckpt in "
            "the checkpoints of the run.",
        )
    return Path(start)
