"""A run's row in TensorBoard's table: what it was trained with, and columns for its test."""

from pathlib import Path
from typing import Any

from lightning.pytorch.loggers import CSVLogger, TensorBoardLogger
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.plugins.hparams.metadata import EXPERIMENT_TAG, SESSION_START_INFO_TAG
from tensorboard.plugins.hparams.plugin_data_pb2 import HParamsPluginData

from derain.models.measured import log_hyperparameters


def entered(folder: Path) -> Any:
    """The run's values, the names of the columns for scores, and the scalars that were logged."""
    events = EventAccumulator(str(folder)).Reload()
    found = {
        tag: HParamsPluginData.FromString(content)
        for tag, content in events.PluginTagToContent("hparams").items()
    }
    values = {
        name: getattr(value, str(value.WhichOneof("kind")))
        for name, value in found[SESSION_START_INFO_TAG].session_start_info.hparams.items()
    }
    columns = [info.name.tag for info in found[EXPERIMENT_TAG].experiment.metric_infos]
    return values, columns, events.Tags()["scalars"]


def test_a_run_has_its_parameters_and_columns_that_stay_blank(tmp_path) -> None:
    logger = TensorBoardLogger(tmp_path, "", "log")
    parameters = {
        **{"learning_rate": 0.01, "neighbours": 9, "network": "outdet", "blind": True},
        **{"channels": ("x", "y"), "candidates": None, "rule": {"residual": 0.1}},
        **{"spec": {"as": "long as a page"}, "_class_path": "hidden"},
    }
    log_hyperparameters([CSVLogger(tmp_path, "csv"), logger], parameters)
    logger.experiment.close()
    values, columns, scalars = entered(tmp_path / "log")
    assert values == {
        **{"learning_rate": 0.01, "neighbours": 9, "network": "outdet", "blind": True},
        **{"channels": "x, y", "candidates": "None", "rule": "{'residual': 0.1}"},
    }
    assert columns[:2] == ["hp_metric", "test/iou"]
    assert {"test/f1", "test/precision", "test/recall", "test/average_precision"} < {*columns}
    assert not scalars  # nothing was measured yet
