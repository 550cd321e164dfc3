"""The start of a training that a user may name: a checkpoint, or the model exported from it."""

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
        InputError: No such file, no checkpoint beside an ONNX file, or that of another model.
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
    _refuse_another(path, checkpoint)
    return checkpoint


def _refuse_another(path: Path, checkpoint: Path) -> None:
    """Refuses a checkpoint whose model is not that of the ONNX file.

    An export may have changed its threshold and candidates.
    """
    from derain.export.model_file import ModelFile
    from derain.models.checkpoint import load_model

    exported, trained = ModelFile.read(path).spec.as_dict(), load_model(checkpoint).spec.as_dict()
    kept = exported.keys() - {"threshold", "candidates"}
    if differing := sorted(key for key in kept if exported[key] != trained[key]):
        raise InputError(
            checkpoint,
            f"is not the checkpoint of {path.name}: they differ in {', '.join(differing)}",
            "Give the checkpoint that it was exported from.",
        )
