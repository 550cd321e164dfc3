"""The help of Lightning's commands: short, and all of it where it is asked for."""

import re

import pytest

from derain.workflows.configurations import packaged_configs


@pytest.mark.parametrize(
    ("command", "option"),
    [("fit", "--help"), ("validate", "-h"), ("test", "--help"), ("predict", "-h")],
)
def test_help_fits_on_a_screen_and_starts_with_examples(succeed, command, option) -> None:
    outcome = succeed(command, option)
    assert len(outcome.out.splitlines()) < 40
    examples, options = outcome.out.split("\noptions:\n")
    assert f"\n  derain {command} --config outdet_wads.yaml --data.root WADS" in examples
    assert all(name in examples for name in packaged_configs())
    assert f"derain {command} --help-all" in options


def test_every_option_of_the_short_help_is_in_the_long_one(run_derain, succeed) -> None:
    short = run_derain("fit", "--help").out.split("\noptions:\n")[1]
    named = set(re.findall(r"^  --([\w.]+)", short, re.MULTILINE))
    every = succeed("fit", "--help-all")
    listed = set(re.findall(r"--([\w.]+)", every.out))
    of_classes = {name for name in named if name.startswith(("data.", "trainer.logger."))}
    assert of_classes < named
    assert named - of_classes <= listed
    assert {"trainer.precision", "checkpoint.monitor", "panels.scans"} <= listed - named


def test_the_options_of_a_class_are_listed_without_a_configuration(succeed) -> None:
    outcome = succeed("fit", "--data.help", "Wads")
    assert "Folder of the data set" in outcome.out


@pytest.mark.parametrize("command", ["fit", "test"])
def test_a_command_alone_names_the_configurations(refused, command) -> None:
    line = refused(command)
    assert line.startswith(f"derain: {command}: no configuration is given. Give --config ")
    assert all(name in line for name in packaged_configs())
