"""The report of a test names the file that it is written to, whatever its folder is called."""

import json
from types import SimpleNamespace

import numpy as np

from derain.cards.card import load_card
from derain.evaluation.hard_cases import scene
from derain.evaluation.metrics import RainMetrics
from derain.models.callbacks.report import TestReport, as_dict, as_text
from derain.scan import Scan


def test_a_score_that_is_undefined_is_a_dash_in_text_and_null_in_json() -> None:
    metrics = RainMetrics(load_card("wads"))
    near = Scan.of(np.tile([3.0, 0, 0], (4, 1))).with_label(np.array([0, 0, 0, 110]))
    metrics.update(near, np.zeros(4, bool))  # rain that is left
    lines = as_text(metrics, "WADS").splitlines()
    assert lines[1].split()[-4:] == ["-", "0.0000", "0.0000", "0.0000"]
    assert [line.split()[-4:] for line in lines if line.startswith("10-20 m")] == [["-"] * 4]
    report = json.loads(json.dumps(as_dict(metrics), allow_nan=False))
    assert report["scores"]["precision"] is None
    assert set(report["ranges"]["10-20 m"].values()) == {None}


def test_the_folder_is_printed_with_escapes(tmp_path, capsys) -> None:
    card, folder = load_card("wads"), tmp_path / "run\n\N{RIGHT-TO-LEFT OVERRIDE}"
    folder.mkdir()
    metrics = RainMetrics(card)
    rain = np.arange(100) < 50
    metrics.update(Scan.of(scene(100)).with_label(np.where(rain, 110, 0)), rain)
    trainer = SimpleNamespace(
        log_dir=str(folder), is_global_zero=True, loggers=[None], ckpt_path="runs/last.ckpt"
    )
    TestReport().on_test_end(trainer, SimpleNamespace(metrics=metrics, card=card))
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == f"Written to {tmp_path}/run\\n\\u202e/test.json"
    report = json.loads((folder / "test.json").read_text())
    assert report["scores"]["iou"] == 1
    assert (report["data"], report["checkpoint"]) == ("WADS", "runs/last.ckpt")
