"""The model that comes with derain: its file, its card, and the check that they belong together."""

import re
from collections.abc import Callable
from dataclasses import asdict, dataclass
from hashlib import file_digest
from importlib import resources
from pathlib import Path
from typing import Any, Self

from derain.errors import InputError
from derain.files.documents import Entry, shown
from derain.files.reading import is_file, reading

# What a user calls the model where other methods have their names.
DEFAULT = "default"

# Where the model's files lie.
FOLDER = Path(str(resources.files("derain.default")))

_REMEDY = "Install derain again, or name a model of your own."

# No seed of a random generator is larger.
LARGEST_SEED = 2**32 - 1


@dataclass(frozen=True)
class ModelScore:
    """Scores of a model on one data set.

    Attributes:
        data: Name of the data, with a word where their rain is simulated.
        iou: Intersection over union of rain, of pooled counts; None if it was not measured, or
            where nothing is rain.
        taken: Share of the points that it takes, which are all mistaken where the data are clean;
            None where it was not measured.
    """

    data: str
    iou: float | None = None
    taken: float | None = None

    @classmethod
    def at(cls, entry: Entry) -> Self:
        """Reads a score from a document.

        Raises:
            InputError: Something that is none.
        """
        parsers = {"data": Entry.text, "iou": _share, "taken": _share}
        return cls(**entry.record(parsers, required=("data",)))


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
        scores: Scores on data that it was not trained on.
        measured: Command that measures it.
        not_for: Cases in which not to use it.
        sha256: SHA-256 of its file, in hexadecimal digits.
    """

    name: str
    version: str
    what: str
    training: tuple[str, ...]
    seed: int
    data: str
    licence: str
    threshold: float
    threshold_chosen: str
    scores: tuple[ModelScore, ...]
    measured: str
    not_for: tuple[str, ...]
    sha256: str

    @classmethod
    def read(cls, path: Path) -> Self:
        """Reads a card.

        Args:
            path: A YAML file with every attribute by its name.

        Raises:
            InputError: A file that cannot be read, or is no such card.
        """
        return cls(**Entry.of_yaml(path).record(_PARSERS, required=_PARSERS))

    @property
    def title(self) -> str:
        """Name, version and the beginning of the checksum: enough to identify it."""
        return f"{self.name}, version {self.version} (sha256 {self.sha256[:12]})"

    def as_dict(self) -> dict[str, Any]:
        """The card as JSON-able primitives; of scores, what was measured."""
        content = asdict(self)
        content["scores"] = [
            {name: value for name, value in score.items() if value is not None}
            for score in content["scores"]
        ]
        return content


def _share(entry: Entry) -> float:
    return entry.within(0, 1)


def _digest(entry: Entry) -> str:
    if not re.fullmatch("[0-9a-f]{64}", entry.text()):
        raise entry.fault(
            f"{shown(entry.value)} is no SHA-256", "Write what `sha256sum` prints of the model."
        )
    return entry.text()


# What reads each part of a card.
_PARSERS: dict[str, Callable[[Entry], Any]] = {
    "name": Entry.text,
    "version": Entry.text,
    "what": Entry.text,
    "training": Entry.texts,
    "seed": lambda entry: entry.whole(0, LARGEST_SEED),
    "data": Entry.text,
    "licence": Entry.text,
    "threshold": _share,
    "threshold_chosen": Entry.text,
    "scores": lambda entry: tuple(map(ModelScore.at, entry.items())),
    "measured": Entry.text,
    "not_for": Entry.texts,
    "sha256": _digest,
}


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
        InputError: It is missing or damaged.
    """
    path = _packaged("card.yaml", "the card of the model")
    try:
        return ModelCard.read(path)
    except InputError as error:
        raise InputError(error.subject, error.reason, _REMEDY) from error


def _packaged(name: str, what: str) -> Path:
    path = FOLDER / name
    if not is_file(path):
        raise InputError(path, f"{what} that comes with derain is missing", _REMEDY)
    return path
