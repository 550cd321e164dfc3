"""What only MCAP has: times of publication, numbers, attachments, metadata, and files alone."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pytest
from mcap.reader import NonSeekingReader, make_reader
from mcap.writer import CompressionType, IndexType, Writer
from small_bags import copied, tables

from benchmarks.fuzzing.false_indexes import (
    chunks_longer_by,
    chunks_times,
    stating,
    with_summary,
    without_a_chunk,
)
from benchmarks.recorded_bags import POINTS, START, Ros, drive
from derain.bags import mcap_reader
from derain.bags.bag import Bag
from derain.errors import InputError
from derain.sources.folders import named_frames

KINDS: dict[str, dict[str, Any]] = {
    "zstd": {},
    "lz4": {"compression": CompressionType.LZ4},
    "not compressed": {"compression": CompressionType.NONE},
    "not chunked": {"use_chunking": False},
}
NOTES = {"offered_qos_profiles": "", "topic_type_hash": "RIHS01_5"}


def record(
    path: Path,
    ros: Ros,
    backwards: bool = False,
    extra: Callable[[Writer], None] | None = None,
    encoding: str | None = None,
    **options: Any,
) -> Path:
    """A file by the library of MCAP's makers."""
    profile, usual = ("ros1", "ros1") if ros.is_ros1 else ("ros2", "cdr")
    encoding = encoding or usual
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=5000, **options)
        writer.start(profile)
        writer.add_metadata("trip", {"driver": "nobody"})
        if extra is not None:
            extra(writer)
        channels: dict[str, int] = {}
        messages = drive(ros, tables(3))
        for number, each in enumerate(reversed(messages) if backwards else messages):
            if each.topic not in channels:
                type_ = each.type.replace("/msg", "") if ros.is_ros1 else each.type
                schema = writer.register_schema(type_, f"{profile}msg", b"a definition")
                channels[each.topic] = writer.register_channel(each.topic, encoding, schema, NOTES)
            message = ros.to_bytes(each.message, each.type)
            place = channels[each.topic]
            writer.add_message(place, each.time, message, each.time - 700, 100 + number)
        writer.add_attachment(START + 1, START, "note.txt", "text/plain", b"a note" * 1000)
        writer.finish()
    return path


def all_of(file: BinaryIO) -> list[tuple[Any, ...]]:
    """Everything that a file has but its clouds' bytes, by the makers' reader."""
    found: list[tuple[Any, ...]] = []
    for schema, channel, each in make_reader(file, validate_crcs=True).iter_messages():
        data = b"" if channel.topic == POINTS else each.data
        found.append((each.log_time, each.publish_time, each.sequence, data, channel.topic))
        found.append((channel.message_encoding, channel.metadata, schema.name, schema.data))
    for each in (NonSeekingReader.iter_attachments, NonSeekingReader.iter_metadata):
        file.seek(0)
        found += [(a,) for a in each(NonSeekingReader(file)) if getattr(a, "name", "") != "rosbag2"]
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_a_cleaned_file_keeps_all_but_the_rain(tmp_path, kind, run_derain) -> None:
    bag = record(tmp_path / "drive.mcap", Ros("mcap"), **KINDS[kind])
    outcome = run_derain("run", "ror", bag, "--out", tmp_path / "out")
    assert (outcome.code, outcome.messages) == (0, [])
    with bag.open("rb") as old, (tmp_path / "out/drive.mcap").open("rb") as new:
        assert all_of(new) == all_of(old)
    assert len(named_frames([tmp_path / "out/drive.mcap"])) == 3


def test_messages_of_a_file_in_any_order_come_in_that_of_time(tmp_path) -> None:
    ros = Ros("mcap")
    forward = Bag(record(tmp_path / "a.mcap", ros))
    for name, options in (("b", {}), ("c", {"use_chunking": False})):
        bag = Bag(record(tmp_path / f"{name}.mcap", ros, backwards=True, **options))
        times = [message.time for message in bag.messages()]
        assert times == sorted(times) == [message.time for message in forward.messages()]
        late = [message.time for message in bag.messages(bag.cloud_topic(), start=times[5])]
        assert late == [
            m.time for m in forward.messages(forward.cloud_topic()) if m.time >= times[5]
        ]


def test_ros_1_in_mcap_is_read_and_written(tmp_path, run_derain) -> None:
    bag = record(tmp_path / "drive.mcap", Ros("ros1"))
    assert run_derain("run", "ror", bag, "--out", tmp_path / "out").code == 0
    for frame, table in zip(named_frames([bag]), tables(3), strict=True):
        np.testing.assert_array_equal(frame.read().xyz[:, 0], table["x"])
    with (tmp_path / "out/drive.mcap").open("rb") as new:
        assert make_reader(new).get_header().profile == "ros1"


def test_clouds_in_another_encoding_are_refused_by_name(tmp_path, run_derain) -> None:
    bag = record(tmp_path / "drive.mcap", Ros("mcap"), encoding="json")
    outcome = run_derain("run", "ror", bag, "--out", tmp_path / "out")
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    info = run_derain("info", bag)
    assert info.code == 0  # the bag has other topics
    for printed in (outcome.err, info.out):
        assert f"{bag}: {POINTS} is encoded as 'json'" in printed


def test_chunks_of_one_time_that_are_too_many_are_refused(tmp_path, monkeypatch) -> None:
    bag = record(tmp_path / "drive.mcap", Ros("mcap"))
    monkeypatch.setattr(mcap_reader, "MOST_HELD", 1000)
    with pytest.raises(InputError, match="overlap in time"):
        list(Bag(bag).messages())


@pytest.mark.parametrize(
    "options",
    [
        {"index_types": IndexType.NONE},
        {"index_types": IndexType.ALL ^ IndexType.METADATA},
        {"use_statistics": False},
        {"repeat_channels": False},
    ],
)
def test_a_file_without_a_whole_index_is_refused(tmp_path, options) -> None:
    bag = record(tmp_path / "drive.mcap", Ros("mcap"), **options)
    with pytest.raises(InputError, match=r"index.*mcap recover"):
        named_frames([bag])


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (stating(10**15), "messages are stated in"),
        (chunks_times(50), "its index"),
        (without_a_chunk, "of 12 messages"),
        (chunks_longer_by(10**5), "overlap"),
        (chunks_longer_by(-1), "as indexed"),
    ],
)
def test_a_summary_that_differs_from_the_data_is_refused(tmp_path, change, reason) -> None:
    bag = record(tmp_path / "drive.mcap", Ros("mcap"))
    bag.write_bytes(with_summary(bag.read_bytes(), change))
    with pytest.raises(InputError, match=reason):
        copied(bag, tmp_path / "out")


@pytest.mark.parametrize("kind", ["zstd", "not chunked"])
def test_a_message_of_no_topic_is_refused(tmp_path, kind) -> None:
    def add_stray(writer: Writer) -> None:
        writer.add_message(99, START, b"", START, 0)

    bag = record(tmp_path / "drive.mcap", Ros("mcap"), extra=add_stray, **KINDS[kind])
    with pytest.raises(InputError, match="not whole"):
        named_frames([bag])


def test_checksums_of_chunks_are_compared(tmp_path) -> None:
    bag = record(tmp_path / "drive.mcap", Ros("mcap"), **KINDS["not compressed"])
    bag.write_bytes(bag.read_bytes().replace(b"a definition", b"a defin?tion", 1))
    with pytest.raises(InputError, match=r"(?i)crc.*chunk"):
        copied(bag, tmp_path / "out")
