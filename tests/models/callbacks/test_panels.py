"""What TensorBoard shows of a training: which epochs and scans are drawn, and where it errs."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import lightning
import numpy as np
import pytest
from lightning.pytorch.loggers import TensorBoardLogger
from matplotlib.figure import Figure
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.util import tensor_util

from derain.datamodules.base import Loading
from derain.datamodules.folder import Folder
from derain.datamodules.in_memory import InMemory
from derain.evaluation.hard_cases import scene
from derain.evaluation.operating_points import CURVE_THRESHOLDS
from derain.files.labels import write_labels
from derain.models.callbacks import panels
from derain.models.callbacks.panels import CHARTS, Panels
from derain.models.outdet import OutDet
from derain.pictures.error_pictures import errors_figure
from derain.scan import Bools, Scan

SNOW = 110
RAINY = (1, 2, 4, 5)  # of six scans
EPOCHS = 2
TABLE, CURVE = "errors by class and range", "threshold"


@pytest.fixture
def rainy(tmp_path) -> Folder:
    for number in range(6):
        scene(60 + number, seed=number).tofile(tmp_path / f"{number}.bin")
        drops = np.arange(60 + number) >= 40
        write_labels(tmp_path / f"{number}.label", SNOW * (drops & (number in RAINY)))
    parts = {"train": ["1.bin"], "validation": ["*.bin"]}
    return Folder(str(tmp_path), "wads", **parts, loading=Loading(batch_size=4))


Drawn = tuple[Scan, dict[str, Bools], Bools, str]


@pytest.fixture
def drawn(monkeypatch) -> list[Drawn]:
    """What figures are made of, in their place an empty one that is drawn in no time."""
    calls: list[Drawn] = []

    def figure(*arguments: Any) -> Figure:
        calls.append(arguments)
        return Figure(figsize=(0.1, 0.1))

    monkeypatch.setattr(panels, "comparison_figure", figure)
    return calls


@pytest.mark.parametrize(("scans", "expected"), [(0, ()), (3, (1, 2, 4)), (9, RAINY)])
def test_the_first_rainy_scans_are_drawn_after_every_epoch(
    make_trainer, rainy, drawn, tmp_path, scans, expected
) -> None:
    judged: list[list[Bools]] = []

    class Judged(lightning.Callback):
        def on_validation_batch_end(self, *arguments: Any) -> None:
            trainer, model, outputs = arguments[:3]
            if not trainer.sanity_checking:
                judged.append([rain > model.spec.threshold for rain in outputs])

    log = TensorBoardLogger(tmp_path, "log", "")
    callbacks = [Panels(scans), Judged()]
    make_trainer(EPOCHS, callbacks=callbacks, logger=log).fit(OutDet(), rainy)

    assert [Path(scan.name).name for scan, *_ in drawn] == [
        f"{number}.bin" for number in expected
    ] * EPOCHS
    predictions = [
        [rain for batch in judged[2 * epoch : 2 * epoch + 2] for rain in batch][number]
        for epoch in range(EPOCHS)
        for number in expected
    ]
    for (scan, predicted, rain, title), prediction in zip(drawn, predictions, strict=True):
        assert title == scan.name
        np.testing.assert_array_equal(rain, np.arange(len(scan)) >= 40)
        np.testing.assert_array_equal(predicted["prediction"], prediction)

    events = EventAccumulator(str(tmp_path / "log"), {"images": 0}).Reload()
    names = [f"validation scan {number}" for number in range(len(expected))]
    images = events.Tags()["images"]
    assert sorted(tag for tag in images if tag.startswith("validation scan ")) == names
    for name in names:
        assert [event.step for event in events.Images(name)] == [1, 2]  # one batch an epoch


def test_without_tensorboard_nothing_is_drawn(make_trainer, rainy, drawn) -> None:
    make_trainer(1, callbacks=[Panels()]).fit(OutDet(), rainy)
    assert not drawn


@pytest.fixture
def data() -> InMemory:
    label = np.where(np.arange(90) >= 60, SNOW, 40)
    scans = [Scan.of(scene(90, seed=seed)).with_label(label) for seed in range(3)]
    return InMemory(train=scans[:1], validation=scans, test=scans[1:], card="wads")


@pytest.fixture(autouse=True)
def _drawn_in_no_time(monkeypatch) -> None:
    for name in ("comparison_figure", "errors_figure", "operating_points_figure"):
        monkeypatch.setattr(panels, name, lambda *_: Figure(figsize=(0.1, 0.1)))


@pytest.fixture
def train(make_trainer, data, tmp_path) -> Callable[..., Any]:
    """Trains 3D-OutDet, and returns the trainer, the model, and what was logged."""

    def run(epochs: int, callback: lightning.Callback, **options: Any) -> tuple[Any, ...]:
        log = TensorBoardLogger(tmp_path, "", "log", default_hp_metric=False)
        trainer = make_trainer(epochs, callbacks=[callback], logger=log, **options)
        model = OutDet()
        trainer.fit(model, data)
        sizes = {"images": 0, "scalars": 0, "tensors": 0}
        return trainer, model, EventAccumulator(str(tmp_path / "log"), sizes).Reload()

    return run


def test_the_numbers_are_those_of_the_counts(train) -> None:
    _, model, events = train(2, Panels())
    last = {
        tag: events.Scalars(tag)[-1].value
        for tag in events.Tags()["scalars"]
        if tag.startswith(("errors_by_class", "rain_left", "lost_by"))
    }
    assert all(len(events.Scalars(tag)) == 2 for tag in last)
    measured = model.metrics.counts()
    pooled, classes = measured.pooled, measured.by_class
    assert {tag for tag in last if tag.startswith("errors_by_class")} == {
        f"errors_by_class/{name}" for name, counts in classes.items() if counts.points
    }
    assert last["errors_by_class/falling-snow"] == pytest.approx(1 - pooled.recall)
    for band, counts in measured.by_range.items():
        left, lost = f"rain_left_by_range/{band}", f"lost_by_range/{band}"
        rain = counts.true_positive + counts.false_negative
        others = counts.false_positive + counts.true_negative
        assert (left in last, lost in last) == (rain > 0, others > 0)
        if rain:
            assert last[left] == pytest.approx(counts.false_negative / rain)
        if others:
            assert last[lost] == pytest.approx(counts.false_positive / others)


def test_the_curve_goes_through_the_counts_at_the_threshold(train) -> None:
    _, model, events = train(1, Panels())
    points = model.threshold_counts.points()
    assert points.counts(points.at(model.spec.threshold)) == model.metrics.counts().pooled
    (event,) = events.Tensors("validation: rain")
    curve = tensor_util.make_ndarray(event.tensor_proto)
    assert curve.shape == (6, len(CURVE_THRESHOLDS))
    counts = model.metrics.counts().pooled
    expected = [
        *(counts.true_positive, counts.false_positive),
        *(counts.true_negative, counts.false_negative),
        *(counts.precision, counts.recall),
    ]
    assert curve[:, 50] == pytest.approx(expected)  # the threshold is a half
    (score,) = events.Scalars("val/average_precision")
    assert score.value == pytest.approx(points.average_precision)


def test_a_training_that_ends_early_is_drawn_as_it_ends(train) -> None:
    _, _, events = train(50, Panels(), max_steps=7)
    for name in (f"validation: {TABLE}", "validation scan 0"):
        assert [event.step for event in events.Images(name)] == [1, 2, 4, 7]


def test_no_pictures_leave_the_numbers(train) -> None:
    _, _, events = train(1, Panels(0))
    assert not events.Tags()["images"]
    assert "errors_by_class/falling-snow" in events.Tags()["scalars"]


def test_scans_without_a_point_have_no_errors(make_trainer, data, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(panels, "errors_figure", errors_figure)
    empty = Scan.of(np.zeros((0, 4))).with_label(np.zeros(0, np.int64))
    nothing = InMemory(data.source("train"), [empty], card="wads")
    log = TensorBoardLogger(tmp_path, "", "log")
    make_trainer(1, callbacks=[Panels()], logger=log).fit(OutDet(), nothing)


def test_scans_without_labels_have_no_errors(make_trainer, data, tmp_path) -> None:
    log = TensorBoardLogger(tmp_path, "", "log")
    trainer = make_trainer(1, callbacks=[Panels()], logger=log, num_sanity_val_steps=0)
    model = OutDet()
    trainer.fit(model, data)
    model.metrics.reset()
    written = len(list(tmp_path.rglob("*")))
    Panels().on_validation_epoch_end(trainer, model)
    assert len(list(tmp_path.rglob("*"))) == written


def test_the_layout_names_what_is_logged(train) -> None:
    _, _, events = train(1, Panels(0))
    (layout,) = events.Tensors("custom_scalars__config__")
    content = layout.tensor_proto.string_val[0]
    for question, charts in CHARTS.items():
        assert all(text.encode() in content for text in (question, *charts))
