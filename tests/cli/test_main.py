"""The command itself: help, version, and one line and exit code 2 for what cannot be used."""

import os
import subprocess
import sys

import pytest

import derain
from derain.cli.main import BROKEN_PIPE, COMMANDS, TRAINING, module_of
from derain.evaluation.hard_cases import scene

MAIN = "import sys; from derain.cli.main import main; sys.exit(main())"


def test_the_version_is_that_of_the_package(run_derain) -> None:
    outcome = run_derain("--version")
    assert (outcome.code, outcome.out) == (0, f"derain {derain.__version__}\n")


def test_help_starts_with_examples_and_names_every_command(succeed) -> None:
    outcome = succeed("--help")
    before_the_options = outcome.out.split("positional arguments")[0]
    assert before_the_options.count("\n  derain ") >= 4
    listed = [line.split()[0] for line in outcome.out.split("COMMAND\n")[-1].splitlines() if line]
    assert {*COMMANDS, *TRAINING} <= set(listed)


@pytest.mark.parametrize("command", COMMANDS)
def test_the_help_of_a_command_starts_with_examples_of_it(succeed, command) -> None:
    outcome = succeed(command, "--help")
    assert f"\n  derain {command}" in outcome.out.split("options:")[0]
    assert max(map(len, str(module_of(command).__doc__).splitlines())) <= 100


def test_the_help_of_run_fits_a_screen_and_help_all_has_every_option(succeed) -> None:
    short, whole = succeed("run", "--help").out, succeed("run", "--help-all").out
    assert len(short.splitlines()) < 60
    assert {"--runtime", "--columns", "--hold"}.isdisjoint(short.split())
    assert {"--out", "--runtime", "--columns", "--hold", "--help-all"} <= set(whole.split())
    assert str(module_of("run").__doc__) in whole


@pytest.mark.parametrize(
    ("arguments", "suffix"),
    [
        (["export", "model.ckpt", "--out"], ".onnx"),
        (["learn", "recording", "--out"], ".onnx"),
        (["import-weights", "outdet", "model.pt", "--stats", "wads", "--out"], ".ckpt"),
        (["tune", "dsor", "--data", "scans", "--out"], ".yaml"),
        (["view", "scan.bin", "--out"], ".png"),
        (["info", "scans", "--picture"], ".png"),
    ],
)
def test_a_file_is_written_only_under_a_suffix_that_it_is_known_by(
    refused, tmp_path, arguments, suffix
) -> None:
    line = refused(*arguments, tmp_path / "model.txt")
    assert f"{arguments[-1]}: {tmp_path / 'model.txt'} does not end in {suffix}" in line


def test_a_reader_that_has_had_enough_ends_the_command_quietly() -> None:
    buffered = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    with subprocess.Popen(
        [sys.executable, "-c", MAIN, "info", "default"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=buffered,
    ) as process:
        process.stdout.close()  # before the command prints anything
        assert process.stderr.read() == b""
        assert process.wait() == BROKEN_PIPE


@pytest.mark.parametrize("closing", [">&-", "2>&-", ">&- 2>&-"])
def test_a_closed_output_is_no_error(tmp_path, closing) -> None:
    scene(100).tofile(tmp_path / "scan.bin")
    command = [sys.executable, "-c", MAIN, "run", "ssr", "scan.bin", "--out", "out"]
    closed = subprocess.run(
        ["sh", "-c", f'"$@" {closing}', "sh", *command],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        check=False,
    )
    assert b"Traceback" not in closed.stderr
    assert (closed.returncode, (tmp_path / "out/scan.label").is_file()) == (0, True)
