"""What a user may name to start a training from: a checkpoint, or the model that it became."""

from pathlib import Path

from derain.default import DEFAULT, default_checkpoint
from derain.errors import InputError
from derain.files.reading import is_file

START_HELP = (
    "begin from the weights of a trained model: a checkpoint, an ONNX file that has its checkpoint "
    f"beside it, or {DEFAULT}"
)

CHECKPOINT, ONNX = ".ckpt", ".onnx"


def checkpoint_of(start: str) -> Path:
    """The checkpoint of the model that a user names.

    An ONNX file holds what is left of a network once it is folded for deployment, from which no
    training goes on; its checkpoint is looked for beside it, under the same name.

    Args:
        start: A checkpoint, an ONNX file, or ``default``.

    Raises:
        InputError: No such file, or no checkpoint beside an ONNX file.
    """
    if start == DEFAULT:
        return default_checkpoint()
    path = Path(start)
    if not is_file(path):
        raise InputError(start, "no such file", f"Give a checkpoint, or {DEFAULT}.")
    if path.suffix != ONNX:
        return path
    checkpoint = path.with_suffix(CHECKPOINT)
    if not is_file(checkpoint):
        raise InputError(
            path,
            f"its weights are folded, and {checkpoint.name} is not beside it",
            "Give the checkpoint that it was exported from; `derain learn` leaves student.ckpt in "
            "its folder.",
        )
    return checkpoint
