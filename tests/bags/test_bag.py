"""Bags that cannot be used, each with the reason: one InputError, whatever is wrong."""

import os
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_bags import bag_path, change_metadata, small_bag, storage_file, tables, topic_of

from benchmarks.recorded_bags import (
    CLOUD_TYPE,
    POINTS,
    START,
    STORAGES,
    TEXT_TYPE,
    Recorded,
    Ros,
    Storage,
    write_bag,
)
from derain.bags import bag as bag_module
from derain.bags import rosbags_reader
from derain.errors import InputError
from derain.sources.folders import named_frames


@pytest.fixture(params=STORAGES)
def storage(request) -> Storage:
    return request.param


def read_all(bag: Path) -> int:
    """Reads a bag to its end, and counts the clouds."""
    return sum(frame.read() is not None for frame in named_frames([bag]))


def refusal(act: Callable[[], Any]) -> str:
    with pytest.raises(InputError) as error:
        act()
    return str(error.value)


def test_an_empty_bag_is_refused(tmp_path, storage) -> None:
    bag = write_bag(bag_path(tmp_path, storage), storage, [])
    assert "no point clouds" in refusal(lambda: named_frames([bag]))


@pytest.mark.parametrize("share", [0.0, 0.5, 0.999])
def test_a_bag_that_is_cut_off_is_refused(tmp_path, storage, share) -> None:
    bag = small_bag(tmp_path, storage)
    file = storage_file(bag)
    os.truncate(file, int(share * file.stat().st_size))
    message = refusal(lambda: read_all(bag))
    assert "\n" not in message
    assert "cannot be read as a bag" in message


def test_an_encrypted_bag_is_refused(tmp_path) -> None:
    bag = small_bag(tmp_path, "ros1")
    content = bag.read_bytes()
    size = int.from_bytes(content[13:17], "little")
    header, rest = content[17 : 17 + size], content[17 + size :]
    field = b"encryptor=rosbag/AesCbcEncryptor"
    header += len(field).to_bytes(4, "little") + field
    padding = int.from_bytes(rest[:4], "little") - 4 - len(field)
    sizes = [number.to_bytes(4, "little") for number in (len(header), padding)]
    bag.write_bytes(content[:13] + sizes[0] + header + sizes[1] + rest[8 + len(field) :])
    assert "AesCbcEncryptor" in refusal(lambda: named_frames([bag]))
    database = small_bag(tmp_path, "sqlite3")
    storage_file(database).write_bytes(np.random.default_rng(0).bytes(2**14))
    assert "not a database" in refusal(lambda: named_frames([database]))


@pytest.mark.parametrize("mode", ["wal", "delete", "persist"])
@pytest.mark.parametrize("alone", [True, False])
def test_a_database_that_is_being_written_is_refused_until_its_log_is_in_it(
    tmp_path, mode, alone
) -> None:
    bag = small_bag(tmp_path, "sqlite3")
    named = storage_file(bag) if alone else bag
    with closing(sqlite3.connect(storage_file(bag), isolation_level=None)) as database:
        database.execute(f"PRAGMA journal_mode = {mode}")
        if mode == "persist":
            database.execute("UPDATE messages SET timestamp = timestamp")
        assert read_all(named) == 3  # a log of nothing hides nothing
        database.execute("BEGIN")
        database.execute("UPDATE messages SET timestamp = timestamp")
        if mode == "wal":
            database.execute("COMMIT")
        message = refusal(lambda: read_all(named))
        assert f"{'-wal' if mode == 'wal' else '-journal'} holds" in message
        assert "wal_checkpoint" in message
    assert read_all(named) == 3


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"compression_mode": "FILE", "compression_format": "lz4"}, "lz4"),
        ({"storage_identifier": "rocksdb"}, "rocksdb"),
        ({"version": 99}, "99"),
        ({"relative_file_paths": ["missing.mcap"]}, "missing"),
    ],
)
def test_metadata_that_the_library_does_not_know_is_refused(tmp_path, change, reason) -> None:
    bag = small_bag(tmp_path, "mcap")
    change_metadata(bag, lambda information: information.update(change))
    assert reason in refusal(lambda: named_frames([bag]))


def test_metadata_may_stand_for_the_file_it_describes(tmp_path) -> None:
    """As Python writes it, where ROS 2 would write it out."""
    bag = small_bag(tmp_path, "sqlite3")
    change_metadata(bag, lambda each: each["files"][0].update(duration=each["duration"]))
    assert "*id001" in (bag / "metadata.yaml").read_text("utf-8")
    assert read_all(bag) == 3


@pytest.mark.parametrize(
    ("name", "remedy"),
    [("drive.bag.active", "rosbag reindex"), ("drive_0.db3.zstd", "Name the bag's folder")],
)
def test_a_file_that_is_no_whole_bag_is_named(tmp_path, name, remedy) -> None:
    (tmp_path / name).touch()
    assert remedy in refusal(lambda: named_frames([tmp_path / name]))


def test_clouds_of_one_stamp_are_warned_of_once(tmp_path, capsys) -> None:
    ros, clouds = Ros("mcap"), tables(4)
    times = (START, START + 5, START + 5, START + 5)
    bag = small_bag(tmp_path, "mcap", clouds=[], more=[
        Recorded("/velodyne_points", CLOUD_TYPE, time, ros.cloud(table, time))
        for table, time in zip(clouds, times, strict=True)
    ])  # fmt: skip
    assert read_all(bag) == 4
    message = capsys.readouterr().err
    assert message.count("has the stamp of") == 1
    assert "000002: has the stamp of" in message


def test_a_bag_with_fewer_clouds_than_it_states_is_refused(tmp_path) -> None:
    bag = small_bag(tmp_path, "sqlite3")
    change_metadata(bag, lambda each: topic_of(each, POINTS).update(message_count=5))
    assert "than the 5 of its index" in refusal(lambda: read_all(bag))


def test_a_topic_with_a_nul_in_its_name_is_refused(tmp_path, storage) -> None:
    text = Recorded("/dri\0ver", TEXT_TYPE, START, Ros(storage).text("no cloud"))
    bag = small_bag(tmp_path, storage, more=[text])
    assert "NUL" in refusal(lambda: named_frames([bag]))


def test_more_topics_than_a_recording_has_are_refused(tmp_path, storage, monkeypatch) -> None:
    bag = small_bag(tmp_path, storage)
    for module in (bag_module, rosbags_reader):
        monkeypatch.setattr(module, "MOST_TOPICS", 2)
    assert "more than 2 topics" in refusal(lambda: named_frames([bag]))
