"""Checkpoints of trainings, from which a training goes on."""

import io
import tempfile
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from benchmarks.fuzzing.mutations import changed
from benchmarks.fuzzing.reader import Reader
from derain.evaluation.hard_cases import scene
from derain.scan import Scan

POINTS = 60

Change = Callable[[dict[str, Any]], object]


def _setting(*way: Any) -> Change:
    """Replaces a value of a checkpoint: the keys that lead to it, and the new value."""
    *above, key, value = way

    def change(content: Any) -> None:
        for step in above:
            content = content[step]
        content[key] = value

    return change


def _dropping(*way: Any) -> Change:
    """Removes a value of a checkpoint."""
    *above, key = way

    def change(content: Any) -> None:
        for step in above:
            content = content[step]
        del content[key]

    return change


def _of_each_callback(name: str, value: Any) -> Change:
    def change(content: dict[str, Any]) -> None:
        for state in content["callbacks"].values():
            state[name] = value

    return change


def _weights(value: float) -> Change:
    return lambda content: content["state_dict"]["network.head.bias"].fill_(value)


def _tensor(*shape: int) -> Any:
    import torch

    return torch.ones(shape)


def _nested(depth: int) -> list[Any]:
    """A list that takes little in a file, and more than any memory where each part is looked at."""
    parts: list[Any] = [1]
    for _ in range(depth):
        parts = [parts, parts]
    return parts


GROUP = ("optimizer_states", 0, "param_groups", 0)
STATE = ("optimizer_states", 0, "state", 0)
EPOCHS = ("loops", "fit_loop", "epoch_progress", "current")
PROGRESS = ("loops", "fit_loop", "epoch_loop.batch_progress")

# Checkpoints that name what they are not, by what is wrong with them.
HOSTILE: dict[str, Change] = {
    "version that is none": _setting("pytorch-lightning_version", "x"),
    "version of long ago": _setting("pytorch-lightning_version", "0.5.0"),
    "version that is a number": _setting("pytorch-lightning_version", 2.6),
    "no version": _dropping("pytorch-lightning_version"),
    "epoch that is a text": _setting("epoch", "three"),
    "negative step": _setting("global_step", -1),
    "hyper-parameters in a list": _setting("hyper_parameters", [1]),
    "no hyper-parameters": _dropping("hyper_parameters"),
    "Spec in a list": _setting("hyper_parameters", "spec", []),
    "learning rate that is a text": _setting("hyper_parameters", "learning_rate", "fast"),
    "learning rate that is a tensor": lambda content: _setting(
        "hyper_parameters", "learning_rate", _tensor()
    )(content),
    "negative learning rate": _setting("hyper_parameters", "learning_rate", -1.0),
    "learning rate of NaN": _setting("hyper_parameters", "learning_rate", float("nan")),
    "infinite weight decay": _setting("hyper_parameters", "weight_decay", float("inf")),
    "milestones that are a text": _setting("hyper_parameters", "milestones", "soon"),
    "milestones that unfold": _setting("hyper_parameters", "milestones", _nested(40)),
    "argument that no network has": _setting("hyper_parameters", "layers", 3),
    "no weights": _setting("state_dict", {}),
    "weights in a list": _setting("state_dict", [1]),
    "weight that is missing": _dropping("state_dict", "network.head.bias"),
    "weight of another shape": lambda content: _setting(
        "state_dict", "network.head.bias", _tensor(7)
    )(content),
    "weight that is a text": _setting("state_dict", "network.head.bias", "heavy"),
    "weights of NaN": _weights(float("nan")),
    "infinite weights": _weights(float("inf")),
    "callbacks in a list": _setting("callbacks", [1]),
    "callbacks that are nothing": _setting("callbacks", None),
    "callbacks in lists": lambda content: content["callbacks"].update(
        {key: [1] for key in content["callbacks"]}
    ),
    "best checkpoint in a list": _of_each_callback("best_model_path", ["best.ckpt"]),
    "score that is a text": _of_each_callback("best_model_score", "high"),
    "best checkpoint without a name": _of_each_callback("best_model_path", ""),
    "loops in a list": _setting("loops", [1]),
    "no loop of a training": _dropping("loops", "fit_loop"),
    "progress that is a text": _setting(*PROGRESS, "far"),
    "progress to the last epoch": _setting(*EPOCHS, "processed", 2),
    "negative progress": _setting(*PROGRESS, "total", "ready", -5),
    "no optimisers": _setting("optimizer_states", []),
    "optimisers in a mapping": _setting("optimizer_states", {"adam": 1}),
    "optimiser without groups": _dropping("optimizer_states", 0, "param_groups"),
    "group without parameters": _setting(*GROUP, "params", []),
    "parameters in another order": lambda content: content["optimizer_states"][0]["param_groups"][
        0
    ]["params"].reverse(),
    "group whose rate is a text": _setting(*GROUP, "lr", "fast"),
    "group whose rate overflows": _setting(*GROUP, "lr", 1e38),
    "group whose rate is NaN": _setting(*GROUP, "lr", float("nan")),
    "moment of another shape": lambda content: _setting(*STATE, "exp_avg", _tensor(7))(content),
    "moment that is missing": _dropping(*STATE, "exp_avg"),
    "moment of NaN": lambda content: content["optimizer_states"][0]["state"][0]["exp_avg"].fill_(
        float("nan")
    ),
    "schedulers in a mapping": _setting("lr_schedulers", {"step": 1}),
    "scheduler of something else": _setting("lr_schedulers", [{"best": 0.1, "patience": 3}]),
    "scheduler whose epoch is a text": _setting("lr_schedulers", 0, "last_epoch", "three"),
    "scheduler whose milestones are a text": _setting("lr_schedulers", 0, "milestones", "soon"),
}


def readers() -> list[Reader]:
    """One that goes on with a training."""
    return [
        Reader(
            "resume",
            "last.ckpt",
            go_on,
            lambda: [trained()],
            [partial(hostile, name) for name in HOSTILE],
            change=_changed,
        )
    ]


def hostile(name: str) -> bytes:
    """A checkpoint that is wrong in one of the ways above."""
    content = _content()
    HOSTILE[name](content)
    return _bytes(content)


@cache
def trained() -> bytes:
    """The checkpoint of a training of one epoch."""
    from derain.models.outdet import OutDet

    with tempfile.TemporaryDirectory() as folder:
        _fit(OutDet(), Path(folder), epochs=1)
        return (Path(folder) / "last.ckpt").read_bytes()


def go_on(path: Path) -> None:
    """Trains another epoch from a checkpoint, as ``derain fit --ckpt_path`` does."""
    from derain.models.checkpoint import check_resumable, network_of_checkpoint
    from derain.workflows.training_errors import refusals_in_a_line

    check_resumable(path)
    network, arguments = network_of_checkpoint(path)
    with tempfile.TemporaryDirectory() as folder, refusals_in_a_line():
        model = network(**arguments)
        _fit(model, Path(folder), epochs=2, ckpt_path=path)
    assert all(tensor.isfinite().all() for tensor in model.state_dict().values())


def _fit(model: Any, folder: Path, epochs: int, ckpt_path: Path | None = None) -> None:
    import lightning
    from lightning.pytorch.callbacks import ModelCheckpoint

    from derain.datamodules.in_memory import InMemory
    from derain.models.callbacks.best_checkpoint import BestCheckpoint
    from derain.models.checkpoint import save_whole
    from derain.models.measured import MONITOR

    scan = Scan.of(scene(POINTS)).with_label(np.resize([0, 110], POINTS))
    trainer = lightning.Trainer(
        accelerator="cpu",
        max_epochs=epochs,
        logger=False,
        enable_progress_bar=False,
        enable_model_summary=False,
        log_every_n_steps=1,
        callbacks=[
            BestCheckpoint(folder, filename="best", monitor=MONITOR, mode="max"),
            ModelCheckpoint(folder, filename="last"),
        ],
    )
    data = InMemory(train=[scan], validation=[scan], card="wads")
    save_whole(trainer).fit(model, data, ckpt_path=ckpt_path)


def _changed(generator: Random) -> bytes:
    """A sound archive of odd values."""
    content = _content()
    part = generator.choice([*content, "all"])
    if part == "all":
        return _bytes(changed(content, generator))
    return _bytes({**content, part: changed(content[part], generator)})


def _content() -> dict[str, Any]:
    import torch

    content: dict[str, Any] = torch.load(io.BytesIO(trained()), weights_only=True)
    return content


def _bytes(content: Any) -> bytes:
    import torch

    file = io.BytesIO()
    torch.save(content, file)
    return file.getvalue()
