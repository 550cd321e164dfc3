"""The report of a test names the file that it is written to, whatever its folder is called."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from derain.cards.card import load_card
from derain.evaluation.hard_cases import scene
from derain.evaluation.metrics import RainMetrics
from derain.models.callbacks.report import TestReport
from derain.scan import Scan


def test_the_folder_is_printed_with_escapes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card, folder = load_card("wads"), tmp_path / "run\n\N{RIGHT-TO-LEFT OVERRIDE}"
    folder.mkdir()
    metrics = RainMetrics(card.classes, card.rain)
    rain = np.arange(100) < 50
    metrics.update_scan(Scan.of(scene(100)).with_label(np.where(rain, 110, 0)), rain)
    trainer = SimpleNamespace(
        log_dir=str(folder), is_global_zero=True, loggers=[], ckpt_path="runs/last.ckpt"
    )
    TestReport().on_test_end(trainer, SimpleNamespace(metrics=metrics, card=card))
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == f"Written to {tmp_path}/run\\n\\u202e/test.json"
    report = json.loads((folder / "test.json").read_text())
    assert report["scores"]["iou"] == 1
    assert (report["data"], report["checkpoint"]) == ("WADS", "runs/last.ckpt")
