"""What a command line gets wrong is one line that names it and what to do."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from derain.cli.main import COMMANDS, module_of
from derain.cli.options import column_names
from derain.cli.parser import Parser
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export.storage import Storage
from derain.files.labels import write_labels
from derain.stores.url import place_of


def parser_of(command: str) -> Parser:
    parser = Parser(f"derain {command}", description=module_of(command).__doc__)
    module_of(command).add_arguments(parser)
    return parser


# What these types refuse is known when the command runs, if at all.
TAKEN_AS_THEY_ARE = (None, Path, place_of, Storage, column_names)


def checked_options() -> Iterator[Any]:
    """The options of every command whose values are checked."""
    for command in COMMANDS:
        for action in parser_of(command)._actions:
            name = "".join(action.option_strings[:1])
            if name and (action.choices or action.type not in TAKEN_AS_THEY_ARE):
                yield pytest.param(command, name, 2 if action.nargs == 2 else 1, id=command + name)


@pytest.mark.parametrize(("command", "option", "values"), list(checked_options()))
def test_a_value_that_an_option_cannot_have_is_refused_in_words(command, option, values) -> None:
    with pytest.raises(InputError) as refusal:
        parser_of(command).parse_args([option, *["a:b"] * values])
    assert refusal.value.subject == option
    assert re.search(r"\ba(:b)?\b", refusal.value.reason)
    assert "invalid" not in refusal.value.reason


@pytest.fixture
def beginner(here) -> None:
    """A working folder with what a beginner has."""
    for folder in ("scans", "empty", "mixed", "drive/velodyne", "drive/labels"):
        Path(folder).mkdir(parents=True)
    for name in ("scans/0.bin", "mixed/0.bin", "drive/velodyne/0.bin"):
        scene(50).tofile(name)
    write_labels(Path("drive/labels/0.label"), np.full(50, 110))  # falling snow of WADS
    Path("mixed/notes.txt").write_text("drove north\n")
    Path("heights.csv").write_text("x,y,height\n1,2,3\n")
    torch.save({"weight": torch.zeros(1)}, "weights.pt")


@pytest.mark.usefixtures("beginner")
@pytest.mark.parametrize(
    ("words", "named"),
    [
        ("run", ("run: ", "SCAN, --out", "`derain run example --out cleaned`")),
        ("run --out o", ("run: ", " SCAN.", "`derain run example --out cleaned`")),
        ("bench", ("--data, --methods, --out", " all none --out bench`")),
        ("", ("COMMAND", "`derain run scans/ --out cleaned`")),
        ("ruun", ("there is no ruun", "Did you mean run?")),
        ("--verison", ("--verison: ", "Did you mean --version?")),
        ("-V", ("-V: ", "no such option", "`derain --help`")),
        ("run dror s --outt o", ("--outt: ", "Did you mean --out?")),
        ("run dror s --out o --gpu", ("--gpu: ", "on the CPU")),
        ("run dror s --out o --device=cuda", ("--device: ", "on the CPU")),
        ("fit --config outdet_wads.yaml --gpu", ("gpu: ", "no such option", "trainer.accelerator")),
        ("simulate --out o --layout stret", ("--layout: ", "Did you mean street?")),
        ("run drror . --out o", ("drror: ", "no such method", "Did you mean dror?")),
        ("run defaul . --out o", ("defaul: ", "Did you mean default?")),
        ("tune dzor --data drive --card wads --out o.yaml", ("dzor: ", "Did you mean dsor?")),
        ("bench --data . --card kiti --methods all --out o", ("kiti: ", "Did you mean kitti?")),
        ("simulate --out o --sensor spining_64", ("Did you mean spinning_64?",)),
        ("import-weights outdt w.pt --stats wads --out o.ckpt", ("Did you mean outdet?",)),
        ("run default . --out o --runtime openvin", ("openvin: ", "Did you mean openvino?")),
        ("run dsor . --out o --set neighbour=3", ("neighbour. Did you mean neighbours?",)),
        ("run empty --out o", ("empty: ", "no scans", "Name a folder")),
        ("run weights.pt scans --out o", ("weights.pt: ", "not an ONNX", "derain import-weights")),
        (
            "bench --data drive --card semantickitti --methods dror --out o",
            ("drive/labels/0.label: ", "[110] are no classes of SemanticKITTI", "--card wads"),
        ),
        (
            "bench --data scans --card wads --methods dror --out o",
            ("scans/0.bin: ", "labels/0.label", "layout: {scans: scans, labels: FOLDER}"),
        ),
    ],
)
def test_a_slip_is_one_line_that_names_what_is_meant(refused, words, named) -> None:
    line = refused(*words.split())
    places = [line.index(part) for part in named]
    assert places == sorted(places)
    assert not [*Path("o").rglob("*")]


@pytest.mark.usefixtures("beginner")
@pytest.mark.parametrize(
    ("words", "code", "named"),
    [
        ("run dror mixed --out o", 0, ("mixed", "1 .txt passed over", "name them")),
        ("run dror heights.csv --out o", 2, ("heights.csv", "no x, y and z", "--columns")),
        ("run crf scans --columns x,y,z,_ --out o", 0, ("scans/0.bin", "no intensity", "dror")),
    ],
)
def test_what_is_odd_about_one_file_is_named(run_derain, words, code, named) -> None:
    outcome = run_derain(*words.split())
    assert outcome.code == code
    (line,) = [line for line in outcome.err.splitlines() if named[1] in line]
    assert all(part in line for part in named)


@pytest.mark.parametrize(
    "words", [["run", "dror", "s", "--ou", "o"], ["run", "--out", "o", "--", "--s"]]
)
def test_an_abbreviated_option_and_a_name_after_two_dashes_are_understood(words) -> None:
    assert parser_of(words[0]).parse_args(words[1:]).out.name == "o"
