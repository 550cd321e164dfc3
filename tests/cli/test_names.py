"""Names of files that a terminal must not be sent, that are no text, or too long for a name."""

import argparse
import json
import os
from pathlib import Path

import numpy as np
import pytest

from derain.cli.options import command_line
from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels

# An escape sequence, bytes that are no UTF-8, a line break, a mark that turns the direction of
# writing, what matplotlib takes for mathematics, another script.
NAMES = [
    b"a\x1b[31m.bin",
    b"b\xff.bin",
    b"c\n.bin",
    b"d\xe2\x80\xae.bin",
    b"e$_$.bin",
    b"f\xc3\xa9.bin",
]

TOO_LONG = 300 * "x"


@pytest.fixture
def scans(here) -> list[Path]:
    """Labelled scans of those names, in a folder of such a name."""
    folder = Path(os.fsdecode(b"dir\xff\x1b[1m"))
    folder.mkdir()
    paths = [folder / os.fsdecode(name) for name in NAMES]
    for path in paths:
        scene(300).tofile(path)
        write_labels(path.with_suffix(".label"), np.where(np.arange(300) >= 270, 110, 0))
    return paths


def assert_fit_for_a_terminal(text: str) -> None:
    text.encode("utf-8")
    assert all(line.isprintable() for line in text.split("\n")), repr(text)


@pytest.mark.parametrize(
    "command",
    [
        ["run", "dror", "{dir}", "--out", "out"],
        ["simulate", "--on", "{dir}", "--rain", "25", "--out", "out"],
        ["info", "{scans}", "--columns", "x,y,z,intensity"],
    ],
)
def test_odd_names_are_fit_for_a_terminal_and_whole_in_json(succeed, scans, command) -> None:
    given = {"{dir}": [scans[0].parent], "{scans}": scans}
    words = [part for word in command for part in given.get(word, [word])]
    outcome = succeed(*words)
    assert_fit_for_a_terminal(outcome.out)
    assert r"dir\udcff\x1b[1m/" in outcome.out
    written = {path.name for path in Path("out").glob("*.bin")}
    assert written in (set(), {path.name for path in scans})
    if command[0] == "simulate":  # which prints lines alone
        return
    facts = [json.loads(line) for line in succeed(*words, "--json").out.splitlines()]
    named = [each.get("scan") or each["file"] for each in facts]
    assert named == list(map(str, scans))


def test_records_and_tables_take_odd_names(succeed, scans) -> None:
    command = ("run", "dror", scans[0].parent, "--out", "out", "--weather", "weather.csv")
    for _ in range(2):
        outcome = succeed(*command, "--resume")
        rows = Path("weather.csv").read_text("utf-8").splitlines()
        assert len(rows) == 1 + len(scans)
        assert_fit_for_a_terminal("\n".join(rows))
    assert f"({len(scans)} of them done before)" in outcome.out
    assert_fit_for_a_terminal(succeed("info", scans[0].parent).out)


def test_what_is_written_of_odd_names_is_text(succeed, scans) -> None:
    data = ["--data", scans[0].parent, "--card", "wads"]
    title = os.fsdecode(b"\xfftitle\x1b[1m=dror")
    once = ["--limit", "1", "--timed", "1", "--repeats", "1"]
    outcome = succeed("bench", *data, "--methods", title, "--out", "bench", *once)
    assert_fit_for_a_terminal(outcome.out)
    assert r"\udcfftitle\x1b[1m" in outcome.out
    assert_fit_for_a_terminal((Path("bench") / "bench.md").read_text("utf-8"))


def test_a_command_line_of_odd_names_is_one_line_of_text() -> None:
    odd = os.fsdecode(b"\xff\nmethod: x")
    line = command_line(argparse.Namespace(command="tune", data=[Path(odd)], method="dror"))
    assert_fit_for_a_terminal(line)
    assert "\n" not in line
    assert r"\udcff\nmethod: x" in line


@pytest.mark.parametrize("number", [1, 4])
def test_odd_names_are_drawn(succeed, scans, number) -> None:
    picture = Path(f"{scans[number].stem}.png")
    outcome = succeed("view", scans[number], "--methods", "dror", "--out", picture)
    assert_fit_for_a_terminal(outcome.out)
    assert picture.stat().st_size > 0


@pytest.mark.parametrize(
    "command",
    [
        ["run", "{long}", "a.bin", "--out", "out"],
        ["run", "dror", "{long}.bin", "--out", "out"],
        ["run", "dror", "a.bin", "--out", "out", "--parameters", "{long}.yaml"],
        ["info", "{long}"],
        ["info", ".", "--card", "{long}"],
        ["bench", "--data", ".", "--card", "wads", "--methods", "{long}=dror", "--out", "{long}"],
        ["tune", "dror", "--data", "{long}", "--card", "wads", "--out", "tuned.yaml"],
        ["view", "a.bin", "--methods", "dror", "--out", "{long}.png"],
        ["simulate", "--out", "{long}"],
        ["annotate", "a.bin", "--scene", "{long}", "--out", "out"],
        ["odometry", "a.bin", "--out", "{long}.txt"],
        ["fuse", "--lidar", ".", "--radar", ".", "--extrinsics", "{long}", "--out", "out"],
    ],
    ids=" ".join,
)
def test_a_name_that_is_too_long_is_one_line(refused, here, command) -> None:
    scene(300).tofile("a.bin")
    assert TOO_LONG in refused(*(word.format(long=TOO_LONG) for word in command))


def test_a_scan_whose_labels_could_have_no_name_does_not_stop_the_others(run_derain, here) -> None:
    Path("scans").mkdir()
    for name in ("a.bin", f"{251 * 'b'}.bin", "c.bin"):  # as long as a name may be
        scene(300).tofile(Path("scans") / name)
    outcome = run_derain("run", "dror", "scans", "--out", "out")
    assert outcome.code == 2
    assert "File name too long" in outcome.err
    assert "derain: 1 of 3 scans could not be cleaned" in outcome.err
    assert {"a.label", "c.label"} == {path.name for path in Path("out").glob("*.label")}


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (PermissionError(13, "Permission denied", "a\x1b.bin"), r"a\x1b.bin: Permission denied."),
        (OSError("odd"), "system: odd."),
        (MemoryError(), "memory: it is full."),
    ],
)
def test_whatever_the_system_refuses_is_one_line(run_derain, monkeypatch, error, line) -> None:
    def refused(arguments: object) -> int:
        raise error

    monkeypatch.setattr("derain.cli.info.main", refused)
    outcome = run_derain("info", "a.bin")
    assert outcome.code == 2
    assert outcome.err.startswith(f"derain: {line}")
    assert len(outcome.err.splitlines()) == 1
