"""The data set that the simulation writes."""

import hashlib
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from derain.errors import InputError
from derain.files.binary import read_binary
from derain.files.labels import read_labels
from derain.scan import Scan
from derain.simulation import dataset
from derain.simulation.classes import TrackClass
from derain.simulation.dataset import Campaign, ensure_track, read_manifest, simulate_track
from derain.simulation.sensor import Sensor

TINY = Campaign(
    train=2,
    validation=1,
    test=1,
    scans=2,
    rain_rates=(0.0, 50.0),
    sensor=Sensor(rows=16, columns=100),
)


def checksums(root: Path) -> dict[str, str]:
    return {
        str(file.relative_to(root)): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(root.rglob("*"))
        if file.is_file()
    }


def scans(root: Path, sequence: str) -> list[Scan]:
    folder = root / "sequences" / sequence
    found = []
    for file in sorted((folder / "lidar_radar_pcd").glob("*.bin")):
        scan = read_binary(file)
        labels = read_labels(folder / "lidar_radar_labels" / f"{file.stem}.label", len(scan))
        found.append(scan.with_label(labels.astype(np.int64)))
    return found


@pytest.fixture(scope="module")
def track(open3d: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("simulated") / "track"
    simulate_track(root, TINY)
    return root


def test_the_folders_and_files_are_those_of_rehearse_3d(track: Path) -> None:
    expected = {
        f"sequences/{sequence}/{folder}/{scan}.{suffix}"
        for sequence in ("000", "001", "002", "003")
        for folder, suffix in (
            ("lidar_radar_pcd", "bin"),
            ("lidar_radar_labels", "label"),
            ("weather", "csv"),
        )
        for scan in ("000000", "000001")
    }
    assert set(checksums(track)) == expected | {"manifest.json"}


def test_scans_hold_labelled_returns_of_the_sensor(track: Path) -> None:
    for sequence in ("000", "001", "002", "003"):
        for scan in scans(track, sequence):
            assert 500 < len(scan) < 16 * 100
            assert scan.valid.all()
            assert scan.intensity is not None
            assert scan.label is not None
            assert (scan.intensity >= 0).all()
            assert (scan.intensity <= 255).all()
            assert set(scan.label) <= set(TrackClass)
            assert scan.range.max() < TINY.sensor.maximum_range + 1


def test_it_rains_where_the_manifest_says_so(track: Path) -> None:
    manifest = read_manifest(track)
    assert manifest["rain_rate_mm_h"] == {"000": 0.0, "001": 50.0, "002": 0.0, "003": 0.0}
    for sequence, rate in manifest["rain_rate_mm_h"].items():
        weather = (track / "sequences" / sequence / "weather" / "000001.csv").read_text()
        assert weather == f"rain_rate_mm_h\n{rate}\n"
        for scan in scans(track, sequence):
            assert np.any(scan.label == TrackClass.RAIN) == (rate > 0)


def test_the_split_covers_every_sequence_once() -> None:
    split = Campaign().split
    names = [name for part in split.values() for name in part]
    assert list(split) == ["train", "validation", "test"]
    assert [len(part) for part in split.values()] == [16, 4, 8]
    assert names == sorted(set(names))
    assert set(Campaign().rain_rate) == set(names)
    for part in split.values():
        assert {Campaign().rain_rate[name] for name in part} == set(Campaign().rain_rates)


def test_sequences_show_different_places_and_scans_of_one_the_same(track: Path) -> None:
    first, again = scans(track, "000")
    other, _ = scans(track, "002")
    assert first.label is not None
    assert again.label is not None
    assert other.label is not None
    assert np.array_equal(first.label, again.label)
    assert np.allclose(first.range, again.range, atol=0.2)
    assert not np.array_equal(first.xyz, again.xyz)
    assert not np.array_equal(first.label, other.label)


def test_a_seed_gives_the_same_bytes_again(track: Path, tmp_path: Path) -> None:
    simulate_track(tmp_path / "again", TINY)
    assert checksums(tmp_path / "again") == checksums(track)


def test_another_seed_gives_other_scans(track: Path, tmp_path: Path) -> None:
    simulate_track(tmp_path / "other", replace(TINY, seed=1))
    first, other = checksums(track), checksums(tmp_path / "other")
    scan = "sequences/000/lidar_radar_pcd/000000.bin"
    assert first[scan] != other[scan]


def test_the_manifest_names_no_place_and_no_date(track: Path) -> None:
    text = (track / "manifest.json").read_text()
    assert str(track.parent) not in text
    assert json.loads(text) == TINY.manifest
    assert set(TINY.manifest) == {"made_by", "version", "campaign", "split", "rain_rate_mm_h"}


def test_a_data_set_that_is_there_is_not_made_twice(track: Path) -> None:
    before = {file: file.stat().st_mtime_ns for file in track.rglob("*")}
    ensure_track(track, TINY)
    assert {file: file.stat().st_mtime_ns for file in track.rglob("*")} == before


def test_a_data_set_of_another_campaign_is_replaced(open3d: ModuleType, tmp_path: Path) -> None:
    root = tmp_path / "track"
    simulate_track(root, TINY)
    smaller = replace(TINY, train=1, scans=1)
    ensure_track(root, smaller)
    assert read_manifest(root) == smaller.manifest
    assert len(list(root.rglob("*.bin"))) == 3
    assert [file.name for file in tmp_path.iterdir()] == ["track"]


def test_a_folder_with_other_things_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "manifest.json").write_text('{"made_by": "somebody else"}')
    (tmp_path / "thesis.txt").write_text("years of work")
    before = checksums(tmp_path)
    with pytest.raises(InputError, match="something other"):
        ensure_track(tmp_path, TINY)
    assert checksums(tmp_path) == before


def test_nothing_half_written_stays(
    open3d: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full_disk(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(dataset, "write_labels", full_disk)
    with pytest.raises(InputError, match="No space left on device"):
        simulate_track(tmp_path / "track", TINY)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "wrong",
    [{"train": 0}, {"scans": 0}, {"seed": -1}, {"rain_rates": ()}, {"rain_rates": (-5.0,)}],
)
def test_an_impossible_campaign_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        replace(TINY, **wrong)


def test_neither_intensity_nor_range_alone_tells_rain(open3d: ModuleType, tmp_path: Path) -> None:
    campaign = replace(TINY, train=6, scans=1, rain_rates=(25.0, 50.0))
    simulate_track(tmp_path / "track", campaign)
    found = [scan for name in campaign.split["train"] for scan in scans(tmp_path / "track", name)]
    rain = np.concatenate([scan.label == TrackClass.RAIN for scan in found])
    for values in (
        np.concatenate([scan.intensity for scan in found]),
        np.concatenate([scan.range for scan in found]),
    ):
        below = rain[np.argsort(values)].cumsum()
        rows = np.arange(1, len(rain) + 1)
        best = (below / (rain.sum() + rows - below)).max()
        assert best < 0.6


def test_open3d_is_imported_only_to_cast() -> None:
    code = "import sys, derain.simulation.dataset; sys.exit('open3d' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
