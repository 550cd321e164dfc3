"""The pictures of validation scans: which are drawn, what of them, and under what names."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import lightning
import numpy as np
import pytest
from lightning.pytorch.loggers import TensorBoardLogger
from matplotlib.figure import Figure
from numpy.typing import NDArray
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from derain.datamodules.base import Loading
from derain.datamodules.folder import Folder
from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels
from derain.models.callbacks import panels
from derain.models.callbacks.panels import ScanPanels
from derain.models.outdet import OutDet
from derain.scan import Scan

MakeTrainer = Callable[..., lightning.Trainer]
SNOW = 110
RAINY = (1, 2, 4, 5)  # of six scans
EPOCHS = 2


@pytest.fixture
def data(tmp_path: Path) -> Folder:
    for number in range(6):
        scene(60 + number, seed=number).tofile(tmp_path / f"{number}.bin")
        drops = np.arange(60 + number) >= 40
        write_labels(tmp_path / f"{number}.label", SNOW * (drops & (number in RAINY)))
    parts = {"train": ["1.bin"], "validation": ["*.bin"]}
    return Folder(str(tmp_path), "wads", **parts, loading=Loading(batch_size=4))


Drawn = tuple[Scan, NDArray[np.bool_], NDArray[np.bool_], str]


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Drawn]:
    """What figures are made of, in their place an empty one that is drawn in no time."""
    calls: list[Drawn] = []

    def figure(*arguments: Any) -> Figure:
        calls.append(arguments)
        return Figure(figsize=(0.1, 0.1))

    monkeypatch.setattr(panels, "judgement_figure", figure)
    return calls


@pytest.mark.parametrize(("scans", "expected"), [(0, ()), (3, (1, 2, 4)), (9, RAINY)])
def test_the_first_rainy_scans_are_drawn_after_every_epoch(
    make_trainer: MakeTrainer,
    data: Folder,
    drawn: list[Drawn],
    tmp_path: Path,
    scans: int,
    expected: tuple[int, ...],
) -> None:
    judged: list[list[NDArray[np.bool_]]] = []

    class Judged(lightning.Callback):
        def on_validation_batch_end(self, *arguments: Any) -> None:
            trainer, model, outputs = arguments[:3]
            if not trainer.sanity_checking:
                judged.append([rain > model.spec.threshold for rain in outputs])

    log = TensorBoardLogger(tmp_path, "log", "")
    callbacks = [ScanPanels(scans), Judged()]
    make_trainer(EPOCHS, callbacks=callbacks, logger=log).fit(OutDet(), data)

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
        np.testing.assert_array_equal(predicted, prediction)

    events = EventAccumulator(str(tmp_path / "log"), {"images": 0}).Reload()
    names = [f"validation scan {number}" for number in range(len(expected))]
    assert sorted(events.Tags()["images"]) == names
    for name in names:
        assert [event.step for event in events.Images(name)] == [1, 2]  # one batch an epoch


def test_without_tensorboard_nothing_is_drawn(
    make_trainer: MakeTrainer, data: Folder, drawn: list[Drawn]
) -> None:
    make_trainer(1, callbacks=[ScanPanels()]).fit(OutDet(), data)
    assert not drawn
