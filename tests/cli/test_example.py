"""The example that comes with derain: cleaned, looked at and described by its name alone."""

import numpy as np
import pytest

import derain
from derain.cards.card import load_card
from derain.errors import InputError
from derain.example import EXAMPLE, example_file, example_folder
from derain.files import read_scan
from derain.sources.folders import named_frames

RAIN = load_card("simulated").rain


def test_it_is_small_and_holds_rain_and_snow() -> None:
    files = [path for path in example_folder().rglob("*") if path.suffix in (".bin", ".label")]
    assert len(files) == 4
    assert sum(path.stat().st_size for path in files) < 1e6
    for weather in ("rain", "snow"):
        scan = derain.example_scan(weather)
        assert 0.03 < np.isin(scan.label, RAIN).mean() < 0.3
        np.testing.assert_array_equal(scan.xyz, read_scan(example_file(weather)).xyz)
    with pytest.raises(InputError, match=r"there is no example of fog\. Give rain or snow\."):
        derain.example_scan("fog")


def test_run_cleans_it_and_prints_what_was_found_beside_the_truth(succeed, here) -> None:
    *_, last = succeed("run", EXAMPLE, "--out", "cleaned").out.splitlines()
    found = others = total = 0
    for weather in ("rain", "snow"):
        scan = derain.example_scan(weather)
        (label,) = (here / "cleaned" / weather).rglob("*.label")
        called, rain = np.fromfile(label, np.uint32) == 1, np.isin(scan.label, RAIN)
        total += rain.sum()
        found += (called & rain).sum()
        others += (called & ~rain).sum()
    assert f"{total:,} points are rain or snow: {found:,} of them" in last
    assert f"{others:,} others" in last
    assert found > 0.9 * total
    assert others < 0.1 * total


def test_info_describes_it(succeed, here) -> None:
    assert "simulated rain" in succeed("info", EXAMPLE).out


def test_labels_of_the_scan_before_it_was_cleaned_are_explained(succeed, refused, here) -> None:
    succeed("run", example_file(), "--out", "cleaned")
    assert "`derain run` writes the labels of the scan that it reads" in refused("info", "cleaned")


def test_view_draws_it(succeed, here) -> None:
    succeed("view", EXAMPLE, "--out", "figure.png")
    assert (here / "figure.png").stat().st_size > 1000


def test_what_a_user_calls_so_is_the_users(succeed, here) -> None:
    folder = here / EXAMPLE
    folder.mkdir()
    read = read_scan(example_file())
    np.column_stack([read.xyz, read.intensity]).astype(np.float32).tofile(folder / "mine.bin")
    assert [frame.key for frame in named_frames(EXAMPLE)] == ["mine"]
    outcome = succeed("run", EXAMPLE, "--out", "cleaned")
    assert "labels" not in outcome.out
    assert (here / "cleaned/mine.label").exists()
