"""The network that ``derain learn`` trains: that asked for by name, or that of its start."""

from dataclasses import replace

import yaml

from derain.cli.lesson import Lesson
from derain.cli.start import checkpoint_of
from derain.errors import InputError

# Networks that learn from labels, and the beginning of their configurations' names.
STUDENTS = ("outdet", "salsanext", "salsanext_lite")

# What a network sees of a point where it is blind to intensity.
BLIND = {"outdet": "[x,y,z]", "salsanext": "[range,x,y,z]", "salsanext_lite": "[range,x,y,z]"}


def with_network(lesson: Lesson) -> Lesson:
    """The same lesson with the network that learns: a student sees what its start does.

    Raises:
        InputError: A start that cannot be read, that would be cleared away, that is of another
            network than the one asked for, or sees intensities to which the student is to be blind.
    """
    if lesson.start is None:
        return replace(lesson, model=lesson.model or STUDENTS[0])
    from derain.models.checkpoint import load_model

    checkpoint = checkpoint_of(lesson.start)
    if lesson.work.resolve() in checkpoint.resolve().parents:
        raise InputError(
            lesson.start,
            f"lies in {lesson.work}, which this run clears first",
            "Give another --work, or copy it elsewhere.",
        )
    spec = load_model(checkpoint).spec
    if lesson.model not in (None, spec.network):
        raise InputError(
            "--model",
            f"{lesson.start} is of {spec.network}, from which {lesson.model} cannot start",
            f"Leave --model out, or give a start of {lesson.model}.",
        )
    sees_intensity = "intensity" in spec.channels
    if lesson.blind and sees_intensity:
        raise InputError(
            "--blind",
            f"{lesson.start} sees intensity, and so will a student that starts from it",
            "Leave one of the two out, or give a start that is blind to it.",
        )
    return replace(lesson, model=spec.network, blind=not sees_intensity)


def without_intensity(lesson: Lesson) -> Lesson:
    """The same lesson for a recording that has no intensities.

    Raises:
        InputError: A start that sees them.
    """
    if lesson.start is not None:
        raise InputError(
            lesson.recordings[0],
            f"has no intensities, which {lesson.start} sees",
            "Give a start that is blind to them, or none.",
        )
    return replace(lesson, blind=True)


def network_options(lesson: Lesson) -> tuple[str, ...]:
    """What ``derain fit`` is told of the network: its configuration, start and channels."""
    if lesson.start is not None:
        return (*_configuration(str(lesson.model)), "--start", lesson.start)
    blind = ("--model.channels", BLIND[str(lesson.model)]) if lesson.blind else ()
    return (*_configuration(str(lesson.model)), *blind)


def epochs_of(lesson: Lesson) -> int:
    """How many epochs the student trains: those asked for, or those of its configuration."""
    from derain.cli.training.configurations import packaged_configs

    _, name, *_ = _configuration(str(lesson.model))
    usual = yaml.safe_load(packaged_configs()[name].read_text("utf-8"))["trainer"]["max_epochs"]
    return lesson.epochs or int(usual)


def _configuration(network: str) -> tuple[str, ...]:
    """The packaged configuration of a network, or that of ours which sees scans as it does."""
    from derain.cli.training.configurations import packaged_configs
    from derain.models.registry import NETWORKS
    from derain.views.neighbours import NeighbourView

    own = f"{network}_taught.yaml"
    if own in packaged_configs():
        return "--config", own
    kind = NETWORKS[network]
    alike = "outdet" if issubclass(kind.VIEW, NeighbourView) else "salsanext"
    return "--config", f"{alike}_taught.yaml", "--model", f"{kind.__module__}.{kind.__qualname__}"
