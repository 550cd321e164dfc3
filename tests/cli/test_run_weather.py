"""``derain run`` measures the weather by its options: scan by scan, as a table, with an alarm."""

import csv
import json
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from derain.cli.main import BROKEN_PIPE
from derain.cli.weather_options import weather_table
from derain.files import read_scan
from derain.scan import Float32s, Floats
from derain.weather.alarm import Alarm, Threshold
from derain.weather.scan_weather import ScanWeather

MAIN = "import sys; from derain.cli.main import main; sys.exit(main())"


def wall(drops: int) -> Float32s:
    """A wall 15 m ahead, 3,000 points, and drops in front of it; float32 (N, 4)."""
    generator = np.random.default_rng(0)
    y, z = np.meshgrid(np.linspace(-1.5, 1.5, 60), np.linspace(-1.2, 1.2, 50))
    solid = np.stack([np.full(3000, 15.0), y.ravel(), z.ravel()], axis=1)
    in_air = generator.uniform([2, -6, -2], [9, 6, 2], (drops, 3))
    points = np.concatenate([solid, in_air])
    return np.column_stack([points, np.full(len(points), 9)]).astype(np.float32)


@pytest.fixture
def recording(tmp_path) -> Path:
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


def rounded_range(metres: float | None) -> float | None:
    return None if metres is None or metres == np.inf else round(metres, 2)


def objects(text: str) -> list[dict[str, Any]]:
    return [json.loads(line)["weather"] for line in text.splitlines()]


def rounded(shares: Floats) -> list[Any]:
    return [None if np.isnan(share) else round(float(share), 5) for share in shares]


LEVELS = ("--warning", "40", "90", "--error", "5", "9", "--hold", "2")


def test_json_holds_the_weather_of_the_written_labels(succeed, recording, tmp_path) -> None:
    out = tmp_path / "out"
    outcome = succeed("run", "dror", recording, "--out", out, "--json", *LEVELS)
    alarm = Alarm(Threshold(40, 90), Threshold(5, 9), hold=2)
    found, weathers = objects(outcome.out), weather_of(recording, out)
    for item, weather in zip(found, weathers, strict=True):
        seen = weather.visibility
        assert item == {
            "rays": weather.rays,
            "met_rain": weather.met_rain,
            "visibility_m": rounded_range(seen.metres),
            "visibility_from_m": rounded_range(seen.at_least),
            "visibility_to_m": rounded_range(seen.at_most),
            "reach_95_m": rounded_range(weather.range_of(0.95).metres),
            "reach_99_m": rounded_range(weather.reach.metres),
            "reach_of_dry": None,
            "level": str(alarm.level_of(seen)),
            "alarm": str(alarm.update(seen)),
            "shares": [rounded(row) for row in weather.shares],
        }
    assert [item["alarm"] for item in found] == [*["clear"] * 3, *["warning"] * 2, "clear"]


@pytest.mark.parametrize("scans", [1, 6])
def test_without_an_option_a_few_scans_are_enough_for_the_last_line(
    run_derain, recording, tmp_path, monkeypatch, scans
) -> None:
    for path in sorted(recording.iterdir())[scans:]:
        path.unlink()
    computed: list[Any] = []
    usual = ScanWeather.of
    monkeypatch.setattr(ScanWeather, "of", lambda *scan: computed.append(scan) or usual(*scan))
    lines = run_derain("run", "dror", recording, "--out", tmp_path / "out").out.splitlines()
    assert len(computed) == min(scans, 5)
    assert not any("visibility" in line for line in lines[:scans])
    assert ("visibility" in lines[-1] and "(of 5 scans)" in lines[-1]) == (scans > 1)


@pytest.mark.parametrize(
    ("asked", "code", "message"),
    [("warning", 3, "the weather was at warning or worse in 2 of 6 scans"), ("error", 0, "")],
)
def test_bad_weather_can_be_known_by_the_exit_code_after_all_scans(
    run_derain, recording, tmp_path, asked, code, message
) -> None:
    out = tmp_path / "out"
    outcome = run_derain("run", "dror", recording, "--out", out, *LEVELS, "--fail-at", asked)
    assert outcome.code == code
    assert message in outcome.err
    assert ("the weather was" in outcome.err) == bool(message)
    pooled = sum(weather_of(recording, out), ScanWeather.none())
    last = outcome.out.splitlines()[-1]
    assert (
        f", visibility {pooled.visibility}, reach 15 m (4 clear, 2 warning, by rain alone); "
        in last
    )


def test_a_table_has_a_line_a_scan_and_nothing_where_nothing_is_known(
    succeed, recording, tmp_path
) -> None:
    out, table = tmp_path / "out", tmp_path / "tables/weather.csv"
    arguments = ("run", "dror", recording, "--out", out, *LEVELS)
    found = objects(succeed(*arguments, "--json").out)
    lines = succeed(*arguments, "--weather", table).out.splitlines()
    with table.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["scan"] for row in rows] == [str(path) for path in sorted(recording.iterdir())]
    for row, line, weather, item in zip(
        rows, lines[:6], weather_of(recording, out), found, strict=True
    ):
        assert f", visibility {weather.visibility}, reach 15 m ({item['level']}" in line
        for name in item.keys() - {"shares"}:
            assert row[name] == ("" if item[name] is None else str(item[name]))
        by_sector = [row[f"share_at_{30 * sector}_deg"] for sector in range(12)]
        expected = rounded(weather.shares_by_sector)
        assert [float(text) if text else None for text in by_sector] == expected
        assert float(row["share_from_10_m"]) == rounded(weather.shares_by_range)[2]
        assert row["time_s"] == ""
    assert "(warning, alarm clear)" in lines[2]
    assert rows[0]["share_at_180_deg"] == ""  # all is ahead of the sensor


def test_scans_that_are_no_recording_have_levels_and_no_alarm(
    run_derain, recording, tmp_path
) -> None:
    for number, name in enumerate(("street", "bridge", "000900", "field", "park", "000100")):
        (recording / f"{number:06d}.bin").rename(recording / f"{name}.bin")
    options = ("--out", tmp_path / "out", "--json", *LEVELS, "--fail-at", "warning")
    outcome = run_derain("run", "dror", recording, *options)
    found = objects(outcome.out)
    by_name = ["clear", "warning", "clear", "warning", "clear", "clear"]
    assert [item["level"] for item in found] == by_name
    assert {item["alarm"] for item in found} == {None}
    assert outcome.code == 3  # by the scans alone


def test_a_table_takes_the_place_of_no_result_and_of_no_other_file(
    refused, recording, tmp_path
) -> None:
    scan = recording / "000003.bin"
    before = scan.read_bytes()
    folders = ("--out", tmp_path / "out", "--removed", tmp_path / "rain")
    results = ("out", "out/000003.bin", "out/000003.label", "rain", "rain/000003.bin")
    for path in (scan, *(tmp_path / name for name in results)):
        assert f"{path}: " in refused("run", "dror", recording, *folders, "--weather", path)
    assert scan.read_bytes() == before
    assert not (tmp_path / "out").exists()


def test_a_run_that_fails_leaves_the_longer_table(tmp_path) -> None:
    table = tmp_path / "weather.csv"
    table.touch()
    for rows, expected in ((3, 3), (2, 3), (4, 4)):
        with suppress(KeyboardInterrupt), weather_table(table, []) as lines:
            lines.extend([number] for number in range(rows))
            raise KeyboardInterrupt
        assert len(table.read_text().splitlines()) == 1 + expected
    with weather_table(table, []) as lines:
        lines.append([0])
    assert len(table.read_text().splitlines()) == 2


def test_a_reader_that_has_had_enough_leaves_whole_results_and_their_table(
    recording, tmp_path
) -> None:
    options = ("--out", tmp_path / "out", "--weather", tmp_path / "weather.csv")
    with subprocess.Popen(
        [sys.executable, "-c", MAIN, "run", "dror", recording, *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        process.stdout.close()  # before the command prints anything
        line = process.stderr.read().splitlines()[-1]
        assert process.wait() == BROKEN_PIPE
    assert "1 of 6 scans are written" in line
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"000000.bin", "000000.label"}
    (_, row) = (tmp_path / "weather.csv").read_text().splitlines()
    assert row.startswith(f"{recording / '000000.bin'},")


def test_scans_of_which_nothing_is_known_have_no_level(
    run_derain, succeed, recording, tmp_path
) -> None:
    (recording / "000001.bin").write_bytes(b"12345")
    table = tmp_path / "weather.csv"
    arguments = ("--out", tmp_path / "o", "--weather", table, *LEVELS, "--fail-at", "warning")
    assert run_derain("run", "dror", recording, *arguments).code == 2  # and not that of weather
    assert len(table.read_text().splitlines()) == 1 + 5
    (tmp_path / "empty.bin").write_bytes(b"")
    outcome = succeed("run", "dror", tmp_path / "empty.bin", "--out", tmp_path / "o", "--json")
    (found,) = objects(outcome.out)
    assert (found.pop("rays"), found.pop("met_rain")) == (0, 0)
    assert found.pop("shares") == [[None] * 6] * 12
    assert set(found.values()) == {None}


@pytest.fixture
def fog(tmp_path) -> tuple[Path, Path]:
    """A dry scan of a long street, and six in fog: nothing returns from beyond 20 m."""
    generator = np.random.default_rng(0)
    azimuth = generator.uniform(-np.pi, np.pi, 12_000)
    reach = np.minimum(6 / np.abs(np.sin(azimuth)), 80) * generator.uniform(0.98, 1, 12_000)
    direction = np.stack([np.cos(azimuth), np.sin(azimuth), generator.normal(0, 0.05, 12_000)])
    dry = np.column_stack([reach[:, None] * direction.T, np.full(12_000, 9)]).astype(np.float32)
    reference, folder = tmp_path / "dry.bin", tmp_path / "fog"
    folder.mkdir()
    dry.tofile(reference)
    for number in range(6):
        dry[reach < 20].tofile(folder / f"{number:06d}.bin")
    return reference, folder


def test_range_that_is_lost_beside_a_dry_reference_is_a_level(run_derain, fog, tmp_path) -> None:
    reference, folder = fog
    arguments = ("run", "ssr", folder, "--out", tmp_path / "out", "--json", "--fail-at", "warning")
    blind, seeing = run_derain(*arguments), run_derain(*arguments, "--dry", reference)
    assert (blind.code, seeing.code) == (0, 3)
    for outcome, level in ((blind, "clear"), (seeing, "warning")):
        for item in objects(outcome.out):
            assert (item["level"], item["alarm"]) == (level, level)
            assert item["reach_95_m"] < item["reach_99_m"] < 21
    assert all(0.2 < item["reach_of_dry"] < 0.3 for item in objects(seeing.out))
    assert "(dry 7" in seeing.err
    assert "(6 clear, by rain alone)" in blind.err
    assert "(6 warning, by rain and range)" in seeing.err


def test_a_reference_that_can_show_no_level_is_refused(
    refused, succeed, recording, tmp_path
) -> None:
    small = recording / "000000.bin"  # a wall at 15 m
    arguments = ("run", "dror", recording, "--out", tmp_path / "out", "--dry", small)
    assert f"{small}: its reach is 15" in refused(*arguments)
    assert "for the error alone" in succeed(*arguments, "--error", "10", "14").err
