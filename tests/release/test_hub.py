"""The folder for a model hub holds the model, and a card that the hub's own library reads."""

from pathlib import Path

import huggingface_hub
import pytest

from derain.default import default_model, model_card
from release.hub import METRICS, page, write


@pytest.fixture(scope="module")
def hub(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("hub") / "hub"
    write(folder)
    return folder


def test_the_folder_holds_model_and_card(hub) -> None:
    assert {file.name for file in hub.iterdir()} == {
        *("README.md", "model.onnx", "model.ckpt", "card.yaml")
    }
    assert (hub / "model.onnx").read_bytes() == default_model().read_bytes()


def test_the_hub_reads_every_score_of_the_card(hub) -> None:
    data = huggingface_hub.ModelCard.load(hub / "README.md").data
    card = model_card()
    assert (data.license, data.library_name) == (card.licence.lower(), "derain")
    assert (data.datasets, data.model_name) == (["simulated-rain"], card.name)
    assert {"lidar", "snow", "onnx"} <= {*data.tags}
    read = {(one.dataset_name, one.metric_type, one.metric_value) for one in data.eval_results}
    assert read == {
        (score["data"], metric, score[metric])
        for score in card.scores
        for metric in METRICS
        if metric in score
    }


def test_the_text_names_what_the_model_is_not_for() -> None:
    text = page(model_card(), "https://example.org/derain")
    assert "https://example.org/derain" in text
    for limit in model_card().not_for:
        assert limit in text
