"""Bags without their rain: what `derain run` writes, and what it leaves as it is."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from contents import contents
from small_bags import bag_path, change_database, change_metadata, small_bag, storage_file, tables

import derain
from benchmarks.recorded_bags import (
    CLOUD_TYPE,
    PERIOD,
    POINTS,
    START,
    STORAGES,
    TEXT,
    TEXT_TYPE,
    Recorded,
    Ros,
    Storage,
    connections_of,
    read_bag,
    table_of,
)
from derain.bags.cloud_message import CDR, ROS1, CloudMessage
from derain.export.runtime import Derainer
from derain.filters import ROR, FilterDerainer
from derain.scan import Bools
from derain.sources.folders import named_frames

RUN = ("run", "ror", "--set", "radius=2", "--set", "neighbours=3")


@pytest.fixture(params=STORAGES)
def storage(request) -> Storage:
    return request.param


def cloud_of(message: bytes, storage: Storage) -> CloudMessage:
    return CloudMessage.parse(message, ROS1 if storage == "ros1" else CDR)


@pytest.fixture
def rain() -> list[Bools]:
    """The rain of each cloud, by the filter itself."""
    ror = FilterDerainer(ROR(radius=2, neighbours=3))
    return [ror(np.column_stack([table[axis] for axis in "xyz"])) for table in tables()]


def test_only_the_points_of_rain_are_lost(tmp_path, storage, run_derain, rain) -> None:
    bag = small_bag(tmp_path, storage)
    for _ in range(2):  # the second time in place of an earlier bag
        outcome = run_derain(*RUN, bag, "--out", tmp_path / "out")
        assert (outcome.code, outcome.messages) == (0, [])
    made = bag_path(tmp_path / "out", storage)

    assert sorted(os.listdir(tmp_path / "out")) == [made.name]
    before, after = read_bag(bag), read_bag(made)
    assert [m[:3] for m in after] == [m[:3] for m in before]
    assert connections_of(made) == connections_of(bag)
    masks = iter(rain)
    for old, new in zip(before, after, strict=True):
        if old[0] != POINTS:
            assert new == old
            continue
        mask = next(masks)
        assert mask.any()
        was, now = cloud_of(old[3], storage), cloud_of(new[3], storage)
        points = np.frombuffer(was.cloud.data, np.uint8).reshape(len(mask), -1)
        assert points[~mask].tobytes() == bytes(now.cloud.data)
        assert now.content.header == was.content.header
        assert now.cloud.fields == was.cloud.fields


def test_what_was_removed_can_be_kept(tmp_path, storage, run_derain, rain) -> None:
    bag = small_bag(tmp_path, storage)
    topic = ("--cleaned-topic", "/points_clean", "--removed-topic", "/rain")
    assert run_derain(*RUN, bag, "--out", tmp_path / "out", *topic).code == 0
    after = read_bag(bag_path(tmp_path / "out", storage))

    # What there was is as it was, in its order.
    added = {"/points_clean": False, "/rain": True}
    assert [m for m in after if m[0] not in added] == read_bag(bag)
    for name, is_rain in added.items():
        messages = [m for m in after if m[0] == name]
        assert [m[2] for m in messages] == [START + number * PERIOD for number in range(3)]
        for message, mask, table in zip(messages, rain, tables(), strict=True):
            columns = cloud_of(message[3], storage).cloud.columns()
            np.testing.assert_array_equal(columns["x"], table["x"][mask == is_rain])


def test_points_can_hold_their_probability_of_rain(tmp_path, run_derain) -> None:
    columns = {name: tables(1)[0][name] for name in ("x", "y", "z", "intensity")}
    taken = table_of({**columns, "rain_probability": np.zeros(300, np.uint16)})
    bag = small_bag(tmp_path, "mcap", clouds=[*tables(), taken])
    outcome = run_derain("run", "default", bag, "--out", tmp_path / "out", "--probability")
    assert outcome.code == 2
    assert outcome.err.count("another field 'rain_probability'") == 1
    *clouds, last = [m[3] for m in read_bag(tmp_path / "out/drive") if m[0] == POINTS]
    assert last == [m[3] for m in read_bag(bag) if m[0] == POINTS][-1]  # it has no place for them
    derainer = Derainer()
    for message, table in zip(clouds, tables(), strict=True):
        points = np.stack([table[name] for name in columns], axis=1)
        probability, rain = derainer.probability(points), derainer(points)
        written = cloud_of(message, "mcap").cloud.columns()["rain_probability"]
        np.testing.assert_array_equal(written, probability[~rain].astype(np.float32))


def test_an_organised_cloud_can_keep_its_shape(tmp_path, run_derain, rain) -> None:
    cloud = Ros("mcap").cloud(tables()[0], START, shape=(10, 30))
    bag = small_bag(tmp_path, "mcap", clouds=[], more=[Recorded(POINTS, CLOUD_TYPE, START, cloud)])
    shapes = []
    for out, options in (("flat", []), ("whole", ["--keep-shape"])):
        assert run_derain(*RUN, bag, "--out", tmp_path / out, *options).code == 0
        (message,) = read_bag(tmp_path / out / "drive")
        now = cloud_of(message[3], "mcap").cloud
        shapes.append((now.height, now.width, int(np.isfinite(now.columns()["x"]).sum())))
    clean = int((~rain[0]).sum())
    assert shapes == [(1, clean, clean), (10, 30, clean)]


def test_a_cloud_that_cannot_be_cleaned_stays_and_is_named(tmp_path, run_derain) -> None:
    first, far, last = tables(3)
    far["x"] *= 1000  # no point has a neighbour
    lost, empty = np.ones(4, [("a", "f4")]), last[:0]
    bag = small_bag(tmp_path, "mcap", clouds=[first, lost, empty, far, last])
    outcome = run_derain(*RUN, bag, "--out", tmp_path / "out", "--most-removed", "0.99")
    before, after = read_bag(bag), read_bag(tmp_path / "out/drive")

    assert outcome.code == 2
    assert outcome.err.count("000001: has no x, y and z") == 1
    assert outcome.err.count("000003: left whole") == 1
    assert "2 of 5 scans could not be cleaned" in outcome.err
    assert [m[:3] for m in after] == [m[:3] for m in before]
    clouds = [(b, a) for b, a in zip(before, after, strict=True) if b[0] == POINTS]
    assert [b == a for b, a in clouds] == [False, True, True, True, False]


@pytest.mark.parametrize("end", [2, 11])  # before the second cloud, and after the last one
@pytest.mark.parametrize("options", [(), ("--resume",)])
def test_nothing_is_left_of_a_bag_that_breaks_off_and_its_error_comes_once(
    tmp_path, run_derain, monkeypatch, end, options
) -> None:
    from rosbags import rosbag2

    bag = small_bag(tmp_path, "sqlite3")
    messages = rosbag2.Reader.messages

    def breaking_off(self, *arguments, **options):
        for number, message in enumerate(messages(self, *arguments, **options)):
            if number == end:
                raise rosbag2.ReaderError("Chunk checksum mismatch.")
            yield message

    monkeypatch.setattr(rosbag2.Reader, "messages", breaking_off)
    np.save(tmp_path / "scan.npy", tables(1)[0])
    outcome = run_derain(*RUN, bag, tmp_path / "scan.npy", "--out", tmp_path / "out", *options)
    assert outcome.code == 2
    assert outcome.err.count("Chunk checksum mismatch") == 1
    assert "3 of 4 scans could not be cleaned" in outcome.err
    assert contents(tmp_path / "out").keys() == {"scan.npy", "scan.label"}


def test_several_bags_and_scans_are_cleaned_in_one_run(tmp_path, run_derain) -> None:
    """And one cloud of a bag as a file."""
    bags = [small_bag(tmp_path, "mcap", "a"), small_bag(tmp_path, "ros1", "b")]
    cloud = small_bag(tmp_path, "mcap", "c") / "000001"
    np.save(tmp_path / "scan.npy", tables(1)[0])
    outcome = run_derain(*RUN, *bags, tmp_path / "scan.npy", cloud, "--out", tmp_path / "out")
    assert (outcome.code, outcome.messages) == (0, [])
    files = {"c/000001.label", "c/000001.pcd", "scan.label", "scan.npy"}
    assert contents(tmp_path / "out").keys() == {"a/a.mcap", "a/metadata.yaml", "b.bag", *files}


def test_a_bag_may_be_cleaned_in_parts(tmp_path, rain) -> None:
    source = named_frames(small_bag(tmp_path, "mcap"))
    ror = FilterDerainer(ROR(radius=2, neighbours=3))
    with derain.CleanSink(tmp_path / "out", source) as sink:
        for part in (source[:2], source[2:]):
            derain.clean(part, ror, sink, most_removed=1)
    cleaned = named_frames(tmp_path / "out/drive")
    assert [len(frame.read()) for frame in cleaned] == [int((~mask).sum()) for mask in rain]


@pytest.mark.parametrize(
    "compression",
    [("mcap", "storage"), ("mcap", "message"), ("mcap", "file"), ("sqlite3", "message"),
     ("sqlite3", "file"), ("ros1", "bz2"), ("ros1", "lz4")],
)  # fmt: skip
def test_compressed_bags_are_read_and_stay_compressed(
    tmp_path, run_derain, compression, monkeypatch
) -> None:
    from rosbags import rosbag1, rosbag2

    from benchmarks import recorded_bags

    storage, mode = compression
    writer_of = recorded_bags._writer

    def compressing(path: Path, storage: Storage) -> object:
        writer = writer_of(path, storage)
        if storage == "ros1":
            writer.set_compression(rosbag1.Writer.CompressionFormat[mode.upper()])
        else:
            zstd = rosbag2.CompressionFormat.ZSTD
            writer.set_compression(rosbag2.CompressionMode[mode.upper()], zstd)
        return writer

    monkeypatch.setattr(recorded_bags, "_writer", compressing)
    bag = small_bag(tmp_path, storage)
    assert run_derain(*RUN, bag, "--out", tmp_path / "out").code == 0
    made = bag_path(tmp_path / "out", storage)
    assert [m[:3] for m in read_bag(made)] == [m[:3] for m in read_bag(bag)]
    if storage == "ros1":
        content = made.read_bytes()
        assert f"compression={mode}".encode() in content
        # What ROS 1 asks of LZ4: blocks on their own, no size, a checksum. The flags follow a mark.
        assert mode != "lz4" or content.split(b"\x04\x22\x4d\x18")[1][0] & 0b101100 == 0b100100
    elif storage == "sqlite3":
        assert storage_file(made).suffixes == storage_file(bag).suffixes
        key = "rosbag2_bagfile_information"
        old, new = (yaml.safe_load((b / "metadata.yaml").read_text())[key] for b in (bag, made))
        assert new["compression_mode"] == old["compression_mode"]
    assert storage_file(made).stat().st_size < 1.5 * storage_file(bag).stat().st_size


def without_hashes(information: dict[str, Any]) -> None:
    for topic in information["topics_with_message_count"]:
        del topic["topic_metadata"]["type_description_hash"]


def test_topics_without_definition_or_hash_are_copied(tmp_path, run_derain) -> None:
    """As ROS 2 before Iron records them, in a database without definitions."""
    bag = small_bag(tmp_path, "sqlite3")
    change_database(bag, "UPDATE topics SET type_description_hash = ''")
    change_database(bag, "DELETE FROM message_definitions")
    change_metadata(bag, without_hashes)
    assert run_derain(*RUN, bag, "--out", tmp_path / "out").code == 0
    made = tmp_path / "out" / "drive"
    assert connections_of(made) == connections_of(bag)
    old, new = ([m for m in read_bag(b) if m[0] != POINTS] for b in (bag, made))
    assert new == old


NAMES = ["a b", "/a\nb", "/a//b", "/é", ""]  # that no topic may have


@pytest.mark.parametrize(
    ("out", "options", "reason"),
    [
        *[("out", ("--cleaned-topic", name), "is not a name of a topic") for name in NAMES],
        ("out", ("--cleaned-topic", "/imu/data"), "a topic /imu/data already"),
        ("drive/cleaned", (), "is inside"),
        ("mine", (), "exists, and is not a bag"),
        ("", (), "would overwrite"),
    ],
)
def test_what_cannot_be_written_is_refused_before_any_work(
    tmp_path, run_derain, out, options, reason
) -> None:
    bag = small_bag(tmp_path, "mcap")
    (tmp_path / "mine/drive").mkdir(parents=True)
    (tmp_path / "mine/drive/notes.txt").touch()
    before = sorted(tmp_path.rglob("*"))
    outcome = run_derain(*RUN, bag, "--out", tmp_path / out, *options)
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert reason in outcome.err
    assert sorted(tmp_path.rglob("*")) == before


def test_bags_of_one_name_in_a_folder_of_recordings_are_written_apart(
    tmp_path, storage, run_derain
) -> None:
    for name in ("a", "b"):
        (tmp_path / "fleet" / name).mkdir(parents=True)
        bag = small_bag(tmp_path / "fleet" / name, storage)
    frames = named_frames(tmp_path / "fleet", topic=POINTS)
    assert [frame.sequence for frame in frames] == [*3 * ["a/drive"], *3 * ["b/drive"]]
    once = run_derain(*RUN, bag, "--out", tmp_path / "once")
    outcome = run_derain(*RUN, tmp_path / "fleet", "--topic", POINTS, "--out", tmp_path / "out")
    assert (once.code, outcome.code, outcome.messages) == (0, 0, [])
    for name in ("a", "b"):
        made = bag_path(tmp_path / "out" / name, storage)
        assert read_bag(made) == read_bag(bag_path(tmp_path / "once", storage))


@pytest.mark.parametrize("options", [(), ("--resume",), ("--poses", "poses")])
@pytest.mark.parametrize("inside", ["", "day"])  # of a folder of bags, and of a folder of those
def test_bags_in_a_folder_that_cannot_be_read_do_not_stop_the_others(
    tmp_path, run_derain, inside, options, monkeypatch
) -> None:
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "fleet" / inside
    small_bag(folder, "mcap", "whole")
    text = Recorded(TEXT, TEXT_TYPE, START, Ros("ros1").text("no cloud"))
    small_bag(folder, "ros1", "no_clouds", clouds=[], more=[text])
    os.truncate(small_bag(folder, "ros1", "cut"), 10_000)
    (tmp_path / "poses" / inside).mkdir(parents=True)
    (tmp_path / "poses" / inside / "whole.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n" * 3)
    outcome = run_derain(*RUN, tmp_path / "fleet", "--out", tmp_path / "out", *options)
    assert outcome.code == 2
    assert outcome.err.count(f"{folder / 'cut.bag'}: cannot be read as a bag") == 1
    assert outcome.err.count(f"{folder / 'no_clouds.bag'}: holds no point clouds") == 1
    assert "2 of 5 scans could not be cleaned" in outcome.err
    assert bool(read_bag(tmp_path / "out" / inside / "whole"))
    named = run_derain(*RUN, folder / "whole", folder / "cut.bag", "--out", tmp_path / "named")
    assert (named.code, (tmp_path / "named").exists()) == (2, False)


def test_a_bag_is_not_written_over_the_results_of_a_folder_of_its_name(
    tmp_path, run_derain
) -> None:
    fleet = tmp_path / "fleet/2024"
    (fleet / "drive").mkdir(parents=True)
    np.zeros((4, 4), "<f4").tofile(fleet / "drive/0.bin")
    storage_file(small_bag(tmp_path, "sqlite3")).rename(fleet / "drive.db3")
    outcome = run_derain(*RUN, tmp_path / "fleet", "--out", tmp_path / "out")
    assert outcome.code == 2
    assert "a bag of that name" in outcome.err
