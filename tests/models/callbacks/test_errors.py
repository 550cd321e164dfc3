"""What is logged of errors: the numbers that the counts give, and no more pictures than asked."""

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

from derain.datamodules.in_memory import InMemory
from derain.evaluation.hard_cases import scene
from derain.evaluation.operating_points import CURVE_THRESHOLDS
from derain.models.callbacks import panels
from derain.models.callbacks.panels import CHARTS, Dashboard, ErrorPanels
from derain.models.outdet import OutDet
from derain.scan import Scan

MakeTrainer = Callable[..., lightning.Trainer]
SNOW = 110
TABLE, CURVE = "errors by class and range", "threshold"


def scan_of(seed: int, labelled: bool = True) -> Scan:
    scan = Scan.of(scene(90, seed=seed))
    return scan.with_label(np.where(np.arange(90) >= 60, SNOW, 40)) if labelled else scan


@pytest.fixture
def data() -> InMemory:
    scans = [scan_of(seed) for seed in range(3)]
    return InMemory(train=scans[:1], validation=scans, test=scans[1:], card="wads")


@pytest.fixture(autouse=True)
def _drawn_in_no_time(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("errors_figure", "operating_points_figure"):
        monkeypatch.setattr(panels, name, lambda *_: Figure(figsize=(0.1, 0.1)))


@pytest.fixture
def train(make_trainer: MakeTrainer, data: InMemory, tmp_path: Path) -> Callable[..., Any]:
    """Trains 3D-OutDet, and returns the trainer, the model, and what was logged."""

    def run(epochs: int, callback: lightning.Callback, **options: Any) -> tuple[Any, ...]:
        log = TensorBoardLogger(tmp_path, "", "log", default_hp_metric=False)
        trainer = make_trainer(epochs, callbacks=[callback], logger=log, **options)
        model = OutDet()
        trainer.fit(model, data)
        sizes = {"images": 0, "scalars": 0, "tensors": 0}
        return trainer, model, EventAccumulator(str(tmp_path / "log"), sizes).Reload()

    return run


def steps_of_images(events: EventAccumulator, name: str) -> list[int]:
    return [event.step for event in events.Images(name)]


def test_the_numbers_are_those_of_the_counts(train: Callable[..., Any]) -> None:
    _, model, events = train(2, ErrorPanels())
    last = {
        tag: events.Scalars(tag)[-1].value
        for tag in events.Tags()["scalars"]
        if tag.startswith(("errors_by_class", "rain_left", "lost_by"))
    }
    assert all(len(events.Scalars(tag)) == 2 for tag in last)
    measured = model.metrics.counts()
    pooled, classes = measured.pooled(), measured.by_class()
    assert {tag for tag in last if tag.startswith("errors_by_class")} == {
        f"errors_by_class/{name}" for name, counts in classes.items() if counts.points
    }
    assert last["errors_by_class/falling-snow"] == pytest.approx(1 - pooled.recall)
    for band, counts in measured.by_range().items():
        left, lost = f"rain_left_by_range/{band}", f"lost_by_range/{band}"
        rain = counts.true_positive + counts.false_negative
        others = counts.false_positive + counts.true_negative
        assert (left in last, lost in last) == (rain > 0, others > 0)
        if rain:
            assert last[left] == pytest.approx(counts.false_negative / rain)
        if others:
            assert last[lost] == pytest.approx(counts.false_positive / others)


def test_the_curve_goes_through_the_counts_at_the_threshold(train: Callable[..., Any]) -> None:
    _, model, events = train(1, ErrorPanels())
    points = model.threshold_counts.points()
    assert points.counts(points.at(model.spec.threshold)) == model.metrics.counts().pooled()
    (event,) = events.Tensors("validation: rain")
    curve = tensor_util.make_ndarray(event.tensor_proto)
    assert curve.shape == (6, len(CURVE_THRESHOLDS))
    counts = model.metrics.counts().pooled()
    expected = [
        *(counts.true_positive, counts.false_positive),
        *(counts.true_negative, counts.false_negative),
        *(counts.precision, counts.recall),
    ]
    assert curve[:, 50] == pytest.approx(expected)  # the threshold is a half
    (score,) = events.Scalars("val/average_precision")
    assert score.value == pytest.approx(points.average_precision)


@pytest.mark.parametrize(
    ("pictures", "epochs", "drawn"), [(2, 5, [1, 5]), (10, 3, [1, 2, 3]), (1, 3, [1, 3])]
)
def test_a_training_has_so_many_pictures(
    train: Callable[..., Any], pictures: int, epochs: int, drawn: list[int]
) -> None:
    _, _, events = train(epochs, ErrorPanels(pictures))
    for name in (TABLE, CURVE):
        assert steps_of_images(events, f"validation: {name}") == drawn


def test_a_training_that_ends_early_is_drawn_as_it_ends(train: Callable[..., Any]) -> None:
    _, _, events = train(50, ErrorPanels(2), max_steps=4)
    assert steps_of_images(events, f"validation: {TABLE}") == [1, 4]


def test_no_pictures_leave_the_numbers(train: Callable[..., Any]) -> None:
    _, _, events = train(1, ErrorPanels(0))
    assert not events.Tags()["images"]
    assert "errors_by_class/falling-snow" in events.Tags()["scalars"]


def test_scans_without_labels_have_no_errors(
    make_trainer: MakeTrainer, data: InMemory, tmp_path: Path
) -> None:
    log = TensorBoardLogger(tmp_path, "", "log")
    trainer = make_trainer(1, callbacks=[ErrorPanels()], logger=log, num_sanity_val_steps=0)
    model = OutDet()
    trainer.fit(model, data)
    model.metrics.reset()
    written = len(list(tmp_path.rglob("*")))
    ErrorPanels().on_validation_epoch_end(trainer, model)
    assert len(list(tmp_path.rglob("*"))) == written


def test_the_layout_names_what_is_logged(train: Callable[..., Any]) -> None:
    _, _, events = train(1, Dashboard())
    (layout,) = events.Tensors("custom_scalars__config__")
    content = layout.tensor_proto.string_val[0]
    for question, charts in CHARTS.items():
        assert all(text.encode() in content for text in (question, *charts))
