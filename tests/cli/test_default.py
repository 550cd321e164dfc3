"""The model that comes with derain, wherever a user meets it on the command line."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from recorded_scenes import write_scenes

from derain.cli.info import card_as_text
from derain.default import default_model, model_card
from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer

NAMED = "by the model that comes with derain: "


@pytest.fixture(autouse=True)
def _scans(here) -> None:
    """Two folders of two scans in the working folder."""
    for folder in ("scans", "crf"):
        write_scenes(here / folder, 200, 200, name="{}.bin")


def judged(folder: Path) -> list[np.ndarray]:
    return [np.fromfile(path, "<u4") for path in sorted(folder.glob("*.label"))]


@pytest.mark.parametrize("words", [["scans/0.bin", "scans/1.bin"], ["default", "scans"], ["./crf"]])
def test_scans_alone_are_cleaned_by_the_model_that_comes_with_derain(
    run_derain, here, words
) -> None:
    outcome = run_derain("run", *words, "--out", "cleaned")
    (message,) = outcome.messages  # the scans have nothing in common
    assert outcome.code == 0
    assert "1.bin: its pose is not known" in message
    first, *lines = outcome.out.splitlines()
    assert first == f"{NAMED}{model_card().title}; what it is, and when not to use it: " + (
        "derain info default"
    )
    assert len(lines) == 3
    derainer = Derainer(default_model(), threads=1)
    expected = [derainer(scene(200, number)) for number in range(2)]
    np.testing.assert_array_equal(judged(here / "cleaned"), expected)


def test_with_json_it_is_named_beside_the_objects(succeed, here) -> None:
    outcome = succeed("run", "scans", "--out", "cleaned", "--json")
    assert [json.loads(line)["points"] for line in outcome.out.splitlines()] == [200, 200]
    assert outcome.err.startswith(NAMED)


@pytest.mark.parametrize(
    "words",
    [
        ["crf", "scans", "--out", "cleaned"],  # though a folder is called so
        ["dror", "--out", "cleaned", "scans"],
        ["--out", "cleaned", "dror", "scans/0.bin", "scans/1.bin"],
    ],
)
def test_a_method_that_is_named_is_the_one_that_cleans(succeed, here, words) -> None:
    outcome = succeed("run", *words)
    assert NAMED not in outcome.out + outcome.err
    assert len(judged(here / "cleaned")) == 2


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["crf"], "crf: it names a method, and also a file or folder here. Write ./crf"),
        (["dror"], "dror: it is a method, and no scans are named. Write `derain run dror SCANS"),
        (["best.yaml"], "best.yaml: it is a method, and no scans are named"),
        (
            ["scnas/", "scans"],
            "scnas/: no such method, file or folder. Give a model written by `derain export`",
        ),
        (["scans", "scnas"], "scnas: there is no such file or folder"),
        (["notes"], "notes: '' is not the suffix of a scan"),
        (["notes", "scans"], "notes: not an ONNX model"),
    ],
)
def test_words_that_can_be_read_in_no_way_or_in_two_are_refused(
    run_derain, here, words, reason
) -> None:
    Path("notes").write_text("of no kind")
    Path("best.yaml").write_text("method: dsor\n")
    outcome = run_derain("run", *words, "--out", "cleaned")
    assert outcome.code == 2
    assert reason in outcome.err
    assert not judged(here / "cleaned")


def test_the_card_is_printed(run_derain, here) -> None:
    outcome = run_derain("info", "default")
    assert (outcome.code, outcome.err) == (0, "")
    card = model_card()
    assert outcome.out.startswith(f"{card.title}, {default_model().stat().st_size:,} bytes\n")
    squeezed = " ".join(outcome.out.split())
    for text in (card.what, *card.not_for, *card.training, card.threshold_chosen, card.sha256):
        assert " ".join(text.split()) in squeezed
    assert max(map(len, outcome.out.splitlines())) <= 100
    facts = json.loads(run_derain("info", "default", "--json").out)
    assert facts == {"file": str(default_model()), **asdict(card)}


def test_scores_of_a_card_are_a_table() -> None:
    scores = [{"data": "WADS sample", "iou": 0.9, "taken": 0.1}, {"data": "clean", "taken": 0.0005}]
    text = card_as_text(replace(model_card(), scores=scores), 10)
    rows = [line.split() for line in text.splitlines()]
    assert ["WADS", "sample", "0.900", "10.000%"] in rows
    assert ["clean", "-", "0.050%"] in rows


def test_a_folder_of_its_name_makes_the_name_ambiguous(run_derain, refused, here) -> None:
    (here / "default").mkdir()
    line = refused("info", "default")
    assert "default: it names the model that comes with derain" in line
    scene(50).tofile(here / "default" / "0.bin")
    assert run_derain("info", here / "default").code == 0
    assert run_derain("info", "./default").code == 0
