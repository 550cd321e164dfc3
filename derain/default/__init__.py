"""The model that comes with derain: its file, its card, and the check that they belong together."""

from dataclasses import dataclass
from hashlib import file_digest
from importlib import resources
from pathlib import Path
from typing import Any

import yaml

from derain.errors import InputError
from derain.files.reading import is_file, reading

# What a user calls the model where other methods have their names.
DEFAULT = "default"

# Where the model's files lie.
FOLDER = Path(str(resources.files("derain.default")))

_REMEDY = "Install derain again, or name a model of your own."


@dataclass(frozen=True)
class ModelCard:
    """The card of a published model: its origin, scores and limits.

    Source: the idea and the headings, M. Mitchell et al., "Model Cards for Model Reporting",
    FAT* 2019.

    Attributes:
        name: Name of the model.
        version: Version of the model among those of this name.
        what: A description of the model and its inputs, in a sentence.
        training: Commands that make it again, in their order.
        seed: Seed of everything that was drawn at random for it.
        data: Its training data.
        licence: Licence of the model, which those of the data allow.
        threshold: A point is rain where its probability is greater; as in its Spec.
        threshold_chosen: The choice of the threshold.
        scores: Scores on data that it was not trained on: by ``data``, the name of the data, with a
            word where their rain is simulated; ``iou``, intersection over union of rain, of pooled
            counts; ``taken``, share of the points that it takes, which are all mistaken where the
            data are clean. What was not measured is not there.
        measured: Command that measures it.
        not_for: Cases in which not to use it.
        sha256: SHA-256 of its file, in hexadecimal digits.
    """

    name: str
    version: str
    what: str
    training: list[str]
    seed: int
    data: str
    licence: str
    threshold: float
    threshold_chosen: str
    scores: list[dict[str, Any]]
    measured: str
    not_for: list[str]
    sha256: str

    @property
    def title(self) -> str:
        """Name, version and the beginning of the checksum: enough to identify it."""
        return f"{self.name}, version {self.version} (sha256 {self.sha256[:12]})"


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
    """The checkpoint of the same model, as a start for training.

    Raises:
        InputError: It is missing.
    """
    return _packaged("model.ckpt", "the checkpoint of the model")


def model_card() -> ModelCard:
    """The card of the model that comes with derain.

    Raises:
        InputError: It is missing.
    """
    path = _packaged("card.yaml", "the card of the model")
    return ModelCard(**yaml.safe_load(path.read_text("utf-8")))


def _packaged(name: str, what: str) -> Path:
    path = FOLDER / name
    if not is_file(path):
        raise InputError(path, f"{what} that comes with derain is missing", _REMEDY)
    return path
