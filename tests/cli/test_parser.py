"""What a command line gets wrong is one line that names it and what to do."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from derain.cli.main import COMMANDS, module_of
from derain.cli.options import column_names
from derain.cli.parser import Parser
from derain.errors import InputError
from derain.export.storage import Storage
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
def test_a_value_that_an_option_cannot_have_is_refused_in_words(
    command: str, option: str, values: int
) -> None:
    with pytest.raises(InputError) as refusal:
        parser_of(command).parse_args([option, *["a:b"] * values])
    assert refusal.value.subject == option
    assert re.search(r"\ba(:b)?\b", refusal.value.reason)
    assert "invalid" not in refusal.value.reason


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ("run", ("run: ", "SCAN, --out", "`derain run example --out cleaned`")),
        ("run --out o", ("run: ", " SCAN.", "`derain run example --out cleaned`")),
        ("bench", ("--data, --methods, --out", " all none --out bench`")),
        ("", ("COMMAND", "`derain run scans/ --out cleaned`")),
        ("ruun", ("there is no ruun", "Did you mean run?")),
        ("run dror s --outt o", ("--outt: ", "Did you mean --out?")),
        ("run dror s --out o --gpu", ("--gpu: ", "on the CPU")),
        ("run dror s --out o --device=cuda", ("--device: ", "on the CPU")),
        ("simulate --out o --layout stret", ("--layout: ", "Did you mean street?")),
        ("run drror . --out o", ("drror: ", "Did you mean dror?")),
        ("run defaul . --out o", ("defaul: ", "Did you mean default?")),
        ("bench --data . --card kiti --methods all --out o", ("kiti: ", "Did you mean kitti?")),
        ("simulate --out o --sensor spining_64", ("Did you mean spinning_64?",)),
        ("import-weights outdt w.pt --stats wads --out o.ckpt", ("Did you mean outdet?",)),
        ("run default . --out o --runtime openvin", ("openvin: ", "Did you mean openvino?")),
        ("run dsor . --out o --set neighbour=3", ("neighbour. Did you mean neighbours?",)),
    ],
)
def test_a_slip_is_one_line_that_names_what_is_meant(
    refused, tmp_path, monkeypatch: pytest.MonkeyPatch, words: str, named: tuple[str, ...]
) -> None:
    monkeypatch.chdir(tmp_path)
    line = refused(*words.split())
    for part in named:
        assert part in line


@pytest.mark.parametrize(
    "words", [["run", "dror", "s", "--ou", "o"], ["run", "--out", "o", "--", "--s"]]
)
def test_an_abbreviated_option_and_a_name_after_two_dashes_are_understood(words: list[str]) -> None:
    assert parser_of(words[0]).parse_args(words[1:]).out.name == "o"
