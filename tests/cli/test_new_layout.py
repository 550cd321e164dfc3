"""A data set that derain has never heard of needs one YAML, its data card."""

import json
from pathlib import Path

import pytest

CARD = """
name: ours
classes: {0: dry, 7: drop}
rain: [7]
layout: {sequences: drives, scans: lidar, labels: truth}
split: {train: [monday], validation: [tuesday], test: [friday]}
"""


@pytest.fixture
def data(tmp_path: Path, write_labelled) -> list[str | Path]:
    """Options for a data set of three drives of two scans each, in folders of their own names."""
    for drive in ("monday", "tuesday", "friday"):
        folder = tmp_path / "ours/drives" / drive
        for number in range(2):
            scan, label = folder / f"lidar/{number}.bin", folder / f"truth/{number}.label"
            write_labelled(scan, label, rain=7)
    (tmp_path / "ours.yaml").write_text(CARD)
    return ["--data", tmp_path / "ours", "--card", tmp_path / "ours.yaml"]


def test_info_counts_it(run_derain, succeed, data: list[str | Path], tmp_path: Path) -> None:
    _, root, *card = data
    for part, sequences in {
        "": 3,
        "drives": 3,
        "drives/friday": 1,
        "drives/friday/lidar": 1,
    }.items():
        outcome = succeed("info", root / part, *card, "--json")
        facts = json.loads(outcome.out)
        assert facts["layout"] == ["lidar", "truth"]
        assert (facts["card"], facts["sequences"], facts["scans"]) == (
            "ours",
            sequences,
            2 * sequences,
        )
        assert facts["points_by_class"] == {"dry": 540 * sequences, "drop": 60 * sequences}
    assert run_derain("info", root).code == 2  # without the card, nothing says where scans lie


def test_methods_are_compared_on_its_test_part(
    succeed, data: list[str | Path], tmp_path: Path
) -> None:
    options = ["--methods", "dror", "--timed", "1", "--repeats", "1", "--out", tmp_path / "bench"]
    succeed("bench", *data, *options)
    (row,) = json.loads((tmp_path / "bench/bench.json").read_text())["rows"]
    assert sum(row["counts"].values()) == 600
    assert row["counts"]["true_positive"] + row["counts"]["false_negative"] == 60
