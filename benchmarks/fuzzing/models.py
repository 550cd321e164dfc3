"""Exported models and checkpoints; torch is imported where it must be."""

import io
import json
import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from benchmarks.fuzzing.mutations import as_json, changed
from benchmarks.fuzzing.reader import Reader
from derain.evaluation.hard_cases import scene
from derain.scan import Scan

POINTS = 60

GRID = {"rows": 18, "columns": 60, "inclination": [-30.0, 20.0]}


# Values of a Spec that stop or fill a process where they are believed.
HOSTILE: Sequence[dict[str, Any]] = (
    {"view": {"kind": "neighbours", "neighbours": -1}},
    {"view": {"kind": "neighbours", "neighbours": 10**9}},
    {"view": None},
    {"threshold": math.nan},
    {"channels": ["x"]},
    {"mean": [1e308] * 4},
)


def write_models(folder: Path) -> None:
    """Writes untrained networks that are quick to export, as models and as checkpoints."""
    import torch

    from derain.cards.card import load_card
    from derain.export.onnx_file import export
    from derain.models.checkpoint import save_model
    from derain.models.outdet import OutDet, network
    from derain.models.salsanext import SalsaNext

    network.BLOCKS = 1  # the same network, traced several times as quickly
    torch.manual_seed(0)
    for model in (OutDet(), SalsaNext(grid=GRID, width=4)):
        model.adopt(model.spec_for(load_card("wads")))
        export(model.eval(), folder / f"{model.NAME}.onnx")
        save_model(model, folder / f"{model.NAME}.ckpt")


def readers(folder: Path) -> list[Reader]:
    """One for exported models and one for checkpoints.

    Args:
        folder: Holds undamaged ones.
    """
    models = sorted(folder.glob("*.onnx"))
    checkpoints = sorted(folder.glob("*.ckpt"))
    return [
        Reader(
            "onnx",
            "model.onnx",
            _read_model,
            lambda: [path.read_bytes() for path in models],
            [partial(_changed_metadata, models[0], partial(_with_spec, spec)) for spec in HOSTILE],
            change=lambda generator: _with_metadata(generator.choice(models), generator),
        ),
        Reader(
            "ckpt",
            "model.ckpt",
            _read_checkpoint,
            lambda: [path.read_bytes() for path in checkpoints],
            change=lambda generator: _with_content(generator.choice(checkpoints), generator),
        ),
    ]


def _read_model(path: Path) -> None:
    from derain.export.runtime import Derainer

    probability = Derainer(path, threads=1).probability(scene(POINTS))
    assert probability.shape == (POINTS,), probability.shape
    assert np.isfinite(probability).all(), "a probability that is not finite"
    assert 0 <= probability.min() <= probability.max() <= 1, "a probability out of 0..1"


def _read_checkpoint(path: Path) -> None:
    from derain.models.checkpoint import load_model

    model = load_model(path)
    model.spec.make_view(1)(Scan.of(scene(POINTS)))


def _with_metadata(path: Path, generator: Random) -> bytes:
    def change(metadata: dict[str, Any]) -> Any:
        if generator.random() < 0.5:
            return changed(metadata, generator)
        return {**metadata, "spec": changed(metadata["spec"], generator)}

    return _changed_metadata(path, change)


def _with_spec(values: dict[str, Any], metadata: dict[str, Any]) -> Any:
    return {**metadata, "spec": {**metadata["spec"], **values}}


def _changed_metadata(path: Path, change: Callable[[dict[str, Any]], Any]) -> bytes:
    """A sound graph with odd metadata, whose checksum is right, so that its Spec is looked at."""
    import onnx

    from derain.export.model_file import CHECKSUM_KEY, METADATA_KEY, NO_CHECKSUM, with_checksum

    proto = onnx.load(path)
    (entry,) = (entry for entry in proto.metadata_props if entry.key == METADATA_KEY)
    metadata = change(json.loads(entry.value) | {CHECKSUM_KEY: NO_CHECKSUM})
    entry.value = as_json(metadata).decode("utf-8", "replace")
    content = proto.SerializeToString()
    return with_checksum(content) if NO_CHECKSUM.encode() in content else content


def _with_content(path: Path, generator: Random) -> bytes:
    """A sound archive of odd values."""
    import torch

    content = torch.load(path, map_location="cpu", weights_only=True)
    part = generator.choice(("hyper_parameters", "hyper_parameters", "state_dict", "all"))
    if part == "all":
        content = changed(content, generator)
    else:
        content[part] = changed(dict(content[part]), generator)
    file = io.BytesIO()
    torch.save(content, file)
    return file.getvalue()
