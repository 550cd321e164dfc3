"""Predictions are written as they come, and nothing of them is kept."""

import weakref
from typing import Any

import lightning
import numpy as np
import pytest

from derain.datamodules.folder import Folder
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.models.callbacks.prediction import PredictionWriter


@pytest.fixture
def data(tmp_path) -> Folder:
    for name in ("a/0.bin", "a/1.bin", "a/2.bin", "b/0.bin"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        scene(50, seed=sum(name.encode())).tofile(tmp_path / name)
    return Folder(str(tmp_path), "wads", test=["*/*.bin"])


class Alive(lightning.Callback):
    """Counts at every batch the probabilities of earlier ones that are still in memory."""

    def __init__(self) -> None:
        self.seen: list[weakref.ref[Any]] = []
        self.counts: list[int] = []

    def on_predict_batch_end(self, trainer: Any, model: Any, outputs: Any, *_: Any) -> None:
        self.counts.append(sum(one() is not None for one in self.seen))
        self.seen += map(weakref.ref, outputs)


def test_what_is_written_is_not_kept(make_trainer, data, outdet, tmp_path, capsys) -> None:
    model, alive, out = outdet(), Alive(), tmp_path / "labels"
    returned = make_trainer(1, callbacks=[alive, PredictionWriter(str(out))]).predict(model, data)
    assert returned is None
    assert len(alive.counts) == 4
    assert max(alive.counts) <= 1  # that of the batch before may wait for this one's
    assert f"Wrote 4 label files to {out}\n" in capsys.readouterr().out
    kept = make_trainer(1).predict(model, data)  # who writes nothing is given what was found
    for frame, (probability,) in zip(data.frames("predict"), kept, strict=True):
        label = out / frame.path.relative_to(data.root).with_suffix(".label")
        expected = probability > model.spec.threshold
        np.testing.assert_array_equal(np.fromfile(label, "<u4"), expected)


def test_no_predictions_lie_where_labels_are_looked_for(
    make_trainer, data, outdet, tmp_path
) -> None:
    files = sorted(tmp_path.rglob("*"))
    with pytest.raises(InputError, match=r"overwrite .* --predictions.folder another"):
        make_trainer(1, callbacks=[PredictionWriter(str(tmp_path))]).predict(outdet(), data)
    assert sorted(tmp_path.rglob("*")) == files


def test_a_scan_that_is_found_twice_is_one_scan(
    make_trainer, data, outdet, tmp_path, capsys
) -> None:
    data.patterns["predict"] = ["*/*.bin", "a/0.bin"]
    out = tmp_path / "\N{RIGHT-TO-LEFT OVERRIDE}"
    make_trainer(1, callbacks=[PredictionWriter(str(out))]).predict(outdet(), data)
    labels = {label.relative_to(out).as_posix() for label in tmp_path.rglob("*.label")}
    assert labels == {"a/0.label", "a/1.label", "a/2.label", "b/0.label"}
    assert f"to {tmp_path}/\\u202e\n" in capsys.readouterr().out
