"""``derain run`` says how bad the weather is: scan by scan, as a table, with levels that hold."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from derain.files import read_scan
from derain.weather.alarm import Alarm, Threshold
from derain.weather.scan_weather import ScanWeather


def wall(drops: int) -> NDArray[np.float32]:
    """A wall 15 m ahead, 3,000 points, and drops in front of it; float32 (N, 4)."""
    generator = np.random.default_rng(0)
    y, z = np.meshgrid(np.linspace(-1.5, 1.5, 60), np.linspace(-1.2, 1.2, 50))
    solid = np.stack([np.full(3000, 15.0), y.ravel(), z.ravel()], axis=1)
    in_air = generator.uniform([2, -6, -2], [9, 6, 2], (drops, 3))
    points = np.concatenate([solid, in_air])
    return np.column_stack([points, np.full(len(points), 9)]).astype(np.float32)


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Six scans: drops in none of the first two, in the next two, and in none of the last."""
    folder = tmp_path / "recording"
    folder.mkdir()
    for number in range(6):
        wall(drops=300 if number in (2, 3) else 0).tofile(folder / f"{number:06d}.bin")
    return folder


def weather_of(folder: Path, out: Path) -> list[ScanWeather]:
    """The same from what was written."""
    return [
        ScanWeather.of(read_scan(file), np.fromfile(out / f"{file.stem}.label", "<u4") > 0)
        for file in sorted(folder.glob("*.bin"))
    ]


def objects(text: str) -> list[dict[str, Any]]:
    return [json.loads(line)["weather"] for line in text.splitlines()]


def rounded(shares: NDArray[np.float64]) -> list[Any]:
    return [None if np.isnan(share) else round(float(share), 5) for share in shares]


LEVELS = ("--warning", "40", "90", "--error", "5", "9", "--hold", "2")


def test_json_says_what_the_labels_that_are_written_say(
    run_derain, recording: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    outcome = run_derain("run", "dror", recording, "--out", out, "--json", *LEVELS)
    assert outcome.code == 0
    alarm = Alarm(Threshold(40, 90), Threshold(5, 9), hold=2)
    told, weathers = objects(outcome.out), weather_of(recording, out)
    for item, weather in zip(told, weathers, strict=True):
        seen = weather.visibility
        assert item == {
            "rays": weather.rays,
            "met_rain": weather.met_rain,
            "visibility_m": None if seen.metres is None else round(seen.metres, 2),
            "visibility_over_m": None if seen.metres is not None else round(seen.at_least, 2),
            "level": str(alarm.update(seen)),
            "shares": [rounded(row) for row in weather.shares],
        }
    assert [item["level"] for item in told] == [
        *("clear", "clear", "clear", "warning", "warning", "clear")
    ]


def test_the_line_of_a_scan_says_visibility_and_level(
    run_derain, recording: Path, tmp_path: Path
) -> None:
    outcome = run_derain("run", "dror", recording, "--out", tmp_path / "out", *LEVELS)
    lines = outcome.out.splitlines()[:6]
    told = [f"visibility {w.visibility}" for w in weather_of(recording, tmp_path / "out")]
    for line, visibility in zip(lines, told, strict=True):
        assert f", {visibility} (" in line
    assert "(warning)" in lines[3]
    assert "(clear)" in lines[0]


@pytest.mark.parametrize(
    ("asked", "code", "told"),
    [
        ("warning", 3, "the weather was at warning or worse in 2 of 6 scans"),
        ("error", 0, ""),
    ],
)
def test_bad_weather_can_be_told_by_the_exit_code_after_all_scans(
    run_derain, recording: Path, tmp_path: Path, asked: str, code: int, told: str
) -> None:
    out = tmp_path / "out"
    outcome = run_derain("run", "dror", recording, "--out", out, *LEVELS, "--fail-at", asked)
    assert outcome.code == code
    assert told in outcome.err
    assert ("the weather was" in outcome.err) == bool(told)
    pooled = sum(weather_of(recording, out), ScanWeather.none())
    last = outcome.out.splitlines()[-1]
    assert f", visibility {pooled.visibility} (4 clear, 2 warning); " in last


def test_a_table_has_a_line_a_scan_and_nothing_where_nothing_is_known(
    run_derain, recording: Path, tmp_path: Path
) -> None:
    out, table = tmp_path / "out", tmp_path / "tables/weather.csv"
    outcome = run_derain("run", "dror", recording, "--out", out, "--weather", table, "--json")
    assert outcome.code == 0
    with table.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["scan"] for row in rows] == [str(path) for path in sorted(recording.iterdir())]
    weathers, told = weather_of(recording, out), objects(outcome.out)
    for row, weather, item in zip(rows, weathers, told, strict=True):
        for name in ("rays", "met_rain", "visibility_m", "visibility_over_m", "level"):
            assert row[name] == ("" if item[name] is None else str(item[name]))
        by_sector = [row[f"share_at_{30 * sector}_deg"] for sector in range(12)]
        by_range = [row[f"share_from_{band}_m"] for band in (0, 5, 10, 20, 40, 80)]
        expected = (weather.shares_by_sector, weather.shares_by_range)
        for texts, shares in zip((by_sector, by_range), expected, strict=True):
            assert [float(text) if text else None for text in texts] == rounded(shares)
        assert row["time_s"] == ""
    assert rows[0]["share_at_180_deg"] == ""  # all is ahead of the sensor


def test_each_recording_begins_anew(run_derain, recording: Path, tmp_path: Path) -> None:
    dry = tmp_path / "data/velodyne"  # sorted behind it, by its name
    dry.mkdir(parents=True)
    wall(drops=0).tofile(dry / "900000.bin")
    rainy = tmp_path / "a"
    rainy.mkdir()
    (recording / "000002.bin").rename(rainy / "000002.bin")
    arguments = ("--out", tmp_path / "out", "--json", *LEVELS)
    outcome = run_derain("run", "dror", rainy, dry, *arguments)
    assert [item["level"] for item in objects(outcome.out)] == ["warning", "clear"]


def test_nothing_is_left_of_the_table_where_the_run_fails(
    run_derain, recording: Path, tmp_path: Path
) -> None:
    scan = recording / "000003.bin"
    before = scan.read_bytes()
    arguments = ("run", "dror", recording, "--out", tmp_path / "out")
    outcome = run_derain(*arguments, "--weather", scan)
    assert (outcome.code, outcome.out) == (2, "")
    assert "it is one of the scans. Give --weather another file" in outcome.err
    assert scan.read_bytes() == before
    outcome = run_derain(*arguments, "--weather", tmp_path / "out")
    assert outcome.code == 2
    assert "it is the folder of --out. Give --weather another file" in outcome.err
    outcome = run_derain(*arguments, "--weather", tmp_path)
    assert outcome.code == 2
    assert "is not a file that can be replaced" in outcome.err
    assert not (tmp_path / "out").exists()


def test_a_scan_that_cannot_be_read_has_no_line(
    run_derain, recording: Path, tmp_path: Path
) -> None:
    (recording / "000001.bin").write_bytes(b"12345")
    table = tmp_path / "weather.csv"
    arguments = ("--out", tmp_path / "o", "--weather", table, *LEVELS, "--fail-at", "warning")
    outcome = run_derain("run", "dror", recording, *arguments)
    assert outcome.code == 2  # and not what bad weather alone ends with
    assert len(table.read_text().splitlines()) == 1 + 5


def test_an_empty_scan_tells_nothing(run_derain, tmp_path: Path) -> None:
    (tmp_path / "empty.bin").write_bytes(b"")
    outcome = run_derain("run", "dror", tmp_path / "empty.bin", "--out", tmp_path / "o", "--json")
    (told,) = objects(outcome.out)
    assert (told["rays"], told["visibility_m"], told["visibility_over_m"]) == (0, None, None)
    assert told["shares"] == [[None] * 6] * 12
    text = run_derain("run", "dror", tmp_path / "empty.bin", "--out", tmp_path / "o").out
    assert "visibility not known (clear)" in text


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (("--warning", "40", "30"), "Give two numbers of metres, the second one greater"),
        (("--error", "35", "38"), "does not lie below the warning"),
        (("--hold", "0"), "--hold: 0 is less than 1"),
        (("--warning", "nan", "30"), "--warning: nan is not a number"),
    ],
)
def test_levels_that_cannot_be_are_refused_before_any_work(
    run_derain, recording: Path, tmp_path: Path, options: tuple[str, ...], reason: str
) -> None:
    outcome = run_derain("run", "dror", recording, "--out", tmp_path / "out", *options)
    assert (outcome.code, outcome.out) == (2, "")
    assert reason in outcome.err
    assert not (tmp_path / "out").exists()
