"""The packaged model and its card, which holds the checksum that the file must have."""

from hashlib import file_digest
from importlib import resources
from pathlib import Path

from derain.default.model_card import ModelCard
from derain.errors import InputError
from derain.files.reading import is_file, reading

# What a user calls the model where other methods have their names.
DEFAULT = "default"

_REMEDY = "Install derain again, or name a model of your own."


def default_model() -> Path:
    """The ONNX file of the model that comes with derain, looked at before it is used.

    Returns:
        The file, whose SHA-256 is that of its card.

    Raises:
        InputError: It is missing, or is not the one that derain came with.
    """
    path = _packaged("model.onnx", "the model")
    with reading(path), path.open("rb") as file:
        found = file_digest(file, "sha256").hexdigest()
    stated = model_card().sha256
    if found != stated:
        raise InputError(
            path,
            "it is not the model that came with derain: its SHA-256 begins with "
            f"{found[:12]}, not with {stated[:12]}",
            _REMEDY,
        )
    return path


def default_checkpoint() -> Path:
    """The checkpoint of the same model, which a training may go on from.

    Raises:
        InputError: It is missing.
    """
    return _packaged("model.ckpt", "the checkpoint of the model")


def model_card() -> ModelCard:
    """The card of the model that comes with derain.

    Raises:
        InputError: It is missing or damaged.
    """
    path = _packaged("card.yaml", "the card of the model")
    try:
        return ModelCard.read(path)
    except InputError as error:
        raise InputError(error.subject, error.reason, _REMEDY) from error


def _packaged(name: str, what: str) -> Path:
    path = _folder() / name
    if not is_file(path):
        raise InputError(path, f"{what} that comes with derain is missing", _REMEDY)
    return path


def _folder() -> Path:
    return Path(str(resources.files("derain.default")))
