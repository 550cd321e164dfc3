"""The data set that the simulation writes: whole, resumable, the same by workers and shards."""

import hashlib
import json
import os
import shutil
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contents import contents

from derain.errors import InputError
from derain.files import read_scan
from derain.files.labels import read_labels
from derain.jobs.job import job_status
from derain.jobs.shard import Shard
from derain.jobs.workers import WorkerPool
from derain.scan import Bools, Float32s, Scan
from derain.simulation import dataset, sequence
from derain.simulation.campaign import Campaign
from derain.simulation.classes import TrackClass
from derain.simulation.dataset import simulate_track
from derain.simulation.manifest import read_manifest
from derain.simulation.sensor import Sensor

TINY = Campaign(
    train=2,
    validation=1,
    test=1,
    scans=2,
    rain_rates=(0.0, 50.0),
    sensor=Sensor(rows=16, columns=100),
)
ONE = replace(TINY, train=1, validation=0, test=0, scans=1)


def times(root: Path) -> dict[Path, int]:
    return {file: file.stat().st_mtime_ns for file in root.rglob("*")}


def scans(root: Path, name: str) -> list[Scan]:
    folder = root / "sequences" / name
    found = []
    for file in sorted((folder / "lidar_radar_pcd").glob("*.bin")):
        scan = read_scan(file)
        labels = read_labels(folder / "lidar_radar_labels" / f"{file.stem}.label", len(scan))
        found.append(scan.with_label(labels.astype(np.int64)))
    return found


@pytest.fixture(scope="module")
def track(open3d, tmp_path_factory) -> Path:
    root = tmp_path_factory.mktemp("simulated") / "track"
    simulate_track(root, TINY)
    return root


def test_scans_hold_labelled_returns_of_their_place_and_rain_by_the_rates(track) -> None:
    rates = read_manifest(track)["rain_rate_mm_h"]
    assert rates == {"000": 0.0, "001": 50.0, "002": 0.0, "003": 50.0}
    for name, rate in rates.items():
        for scan in scans(track, name):
            assert 500 < len(scan) < 16 * 100
            assert scan.valid.all()
            assert (scan.intensity >= 0).all()
            assert (scan.intensity <= 255).all()
            assert set(scan.label) <= set(TrackClass)
            assert scan.range.max() < TINY.lidar.maximum_range + 1
            assert np.any(scan.label == TrackClass.RAIN) == (rate > 0)
    # Sequences show different places, and scans of one the same.
    first, again = scans(track, "000")
    other, _ = scans(track, "002")
    assert np.array_equal(first.label, again.label)
    assert np.allclose(first.range, again.range, atol=0.2)
    assert not np.array_equal(first.xyz, again.xyz)
    assert not np.array_equal(first.label, other.label)


def test_the_manifest_describes_the_campaign_and_every_other_file_and_names_no_folder(
    track,
) -> None:
    manifest, there = read_manifest(track), contents(track)
    del there["manifest.json"]
    checksums = {name: hashlib.sha256(content).hexdigest() for name, content in there.items()}
    assert manifest == {**TINY.description, "files": checksums}
    assert str(track.parent) not in json.dumps(manifest)


def test_a_run_that_failed_leaves_nothing_half_written_and_is_taken_up_by_any_workers(
    track, tmp_path, monkeypatch
) -> None:
    root, write = tmp_path / "track", sequence.write_labels

    def disk_gets_full(path: Path, *labels: object) -> None:
        if "001" in path.parts[-3]:
            raise OSError(28, "No space left on device")
        write(path, *labels)

    root.mkdir()
    (root / ".derain-0.json").write_bytes(b"half a manifest")  # as a kill leaves it
    with monkeypatch.context() as patched:
        patched.setattr(sequence, "write_labels", disk_gets_full)
        with pytest.raises(InputError, match="No space left on device"):
            simulate_track(root, TINY)
    assert sorted(os.listdir(root / "sequences")) == ["000", "002", "003"]
    assert "files" not in read_manifest(root)
    (failed,) = job_status(root, lambda record: None).failed
    assert failed.unit == "001"
    (root / "sequences/.derain-1/001/innoviz").mkdir(parents=True)  # as a kill leaves it
    kept = times(root / "sequences/000")
    with WorkerPool(2) as workers:
        simulate_track(root, TINY, workers)
        shutil.rmtree(root / "sequences/002")  # and of one that is complete what is gone
        simulate_track(root, TINY, workers)
    assert times(root / "sequences/000") == kept
    assert contents(root) == contents(track)


def test_shards_make_the_same_data_set_and_the_last_completes_its_manifest(track, tmp_path) -> None:
    root = tmp_path / "track"
    assert not simulate_track(root, TINY, shard=Shard(1, 2))
    assert "files" not in read_manifest(root)
    assert simulate_track(root, TINY, shard=Shard(0, 2))
    assert contents(root) == contents(track)


def test_a_data_set_that_is_there_is_not_made_twice(track) -> None:
    before = times(track)
    assert simulate_track(track, TINY)
    assert times(track) == before


@pytest.mark.parametrize("seed", [0, 1])
def test_two_runs_that_begin_at_once_write_the_same_or_the_second_is_refused(
    track, tmp_path, monkeypatch, seed
) -> None:
    root, both = tmp_path / "track", threading.Barrier(2)
    refused = list[InputError]()

    def read_at_once(root: Path) -> dict[str, Any]:
        there = read_manifest(root)
        both.wait(60)
        return there

    def simulate(campaign: Campaign) -> None:
        try:
            simulate_track(root, campaign)
        except InputError as error:
            refused.append(error)

    monkeypatch.setattr(dataset, "read_manifest", read_at_once)
    campaigns = TINY, replace(TINY, seed=seed)
    runs = [threading.Thread(target=simulate, args=(campaign,)) for campaign in campaigns]
    for run in runs:
        run.start()
    for run in runs:
        run.join()
    assert [str(error).count("seed was") for error in refused] == [1] * seed
    written = read_manifest(root)
    assert "files" in written
    if not written["campaign"]["seed"]:
        assert contents(root) == contents(track)


def test_what_others_made_or_cannot_be_is_left_alone(track, tmp_path) -> None:
    (tmp_path / "manifest.json").write_text('{"made_by": "somebody else"}')
    (tmp_path / "thesis.txt").write_text("years of work")
    before = times(track) | times(tmp_path)
    for root, campaign, reason in (
        (track, replace(TINY, seed=1), "other parameters"),
        (tmp_path, TINY, "something other"),
        (tmp_path / "thesis.txt", TINY, r"thesis\.txt: cannot be written"),
        (tmp_path / "new", replace(TINY, sensor="mars"), "mars: no such sensor"),
    ):
        with pytest.raises(InputError, match=reason):
            simulate_track(root, campaign)
    assert times(track) | times(tmp_path) == before


def test_neither_range_nor_intensity_separates_rain_in_a_street(open3d, tmp_path) -> None:
    simulate_track(tmp_path, replace(ONE, train=3, rain_rates=(50.0,)))
    found = [scan for name in ("000", "001", "002") for scan in scans(tmp_path, name)]
    rain = np.concatenate([scan.label == TrackClass.RAIN for scan in found])
    assert best_bound(np.concatenate([scan.range for scan in found]), rain) < 0.6
    assert best_bound(np.concatenate([scan.intensity for scan in found]), rain) < 0.6


def best_bound(values: Float32s, rain: Bools) -> float:
    """The greatest IoU of all bounds below which points are called rain."""
    below = rain[np.argsort(values)].cumsum()
    rows = np.arange(1, len(rain) + 1)
    return float((below / (rain.sum() + rows - below)).max())
