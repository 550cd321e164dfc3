"""Training that begins from the weights of a trained model, and not at random."""

from hashlib import sha256
from pathlib import Path

from derain.errors import InputError
from derain.files.reading import reading
from derain.learning.start import Start
from derain.models.base import DerainingModule
from derain.models.checkpoint import load_model

# Digits of a checksum that tell one checkpoint from others.
CHECKSUM_DIGITS = 12


def started(model: DerainingModule, checkpoint: Path, name: str) -> DerainingModule:
    """A model of the same kind that begins where another one has ended.

    Network, channels, view and normalisation are those of the checkpoint; how it is trained, and
    its threshold and candidates, are as the model says (its ``RECIPE``).

    Example:
        >>> recipe = OutDet(neighbours=5, learning_rate=0.002)
        >>> student = started(recipe, Path("model.ckpt"), "mine")
        >>> student.hparams["neighbours"], student.hparams["learning_rate"]
        (9, 0.002)

    Args:
        model: A model that has not been trained.
        checkpoint: A checkpoint that derain wrote.
        name: What the Spec calls it.

    Raises:
        InputError: A checkpoint that cannot be read, or one of another network.
    """
    source = load_model(checkpoint)
    arguments = {
        argument: (
            model if argument in model.RECIPE or argument not in source.hparams else source
        ).hparams[argument]
        for argument in model.hparams
        if argument != "spec" and not argument.startswith("_")
    }
    student = type(model)(**arguments)
    try:
        student.begin_from(source)
    except InputError as error:
        raise InputError(checkpoint, error.reason, error.remedy) from error
    # By what Lightning's command line has entered there, it reads a checkpoint back.
    student.hparams.update({key: own for key, own in model.hparams.items() if key[0] == "_"})
    with reading(checkpoint):
        checksum = sha256(checkpoint.read_bytes()).hexdigest()[:CHECKSUM_DIGITS]
    student.start = Start(f"{name} ({checksum})", source.spec)
    return student
