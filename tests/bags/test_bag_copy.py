"""What a bag holds besides messages is copied, warned of, or a reason to refuse."""

import re
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import yaml
from small_bags import small_bag, storage_file

from benchmarks.fuzzing.false_indexes import ros1_with_index
from benchmarks.recorded_bags import POINTS, TEXT
from derain.bags.bag import Bag
from derain.bags.bag_copy import BagCopy
from derain.errors import InputError


def copied(path: Path, out: Path) -> Bag:
    bag = Bag(path)
    out.mkdir()
    with BagCopy(bag, bag.cloud_topic(), out) as copy:
        return Bag(copy.finish())


def change_database(bag: Path, statement: str) -> None:
    with closing(sqlite3.connect(storage_file(bag))) as database, database:
        database.execute(statement)


def change_topics(bag: Path, change: Callable[[list[dict[str, Any]]], object]) -> None:
    """Changes the topics of the metadata; the database has the same messages as before."""
    metadata = yaml.safe_load((bag / "metadata.yaml").read_text("utf-8"))
    change(metadata["rosbag2_bagfile_information"]["topics_with_message_count"])
    (bag / "metadata.yaml").write_text(yaml.safe_dump(metadata), "utf-8")


def topic_of(topics: list[dict[str, Any]], name: str) -> dict[str, Any]:
    return next(each for each in topics if each["topic_metadata"]["name"] == name)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (
            lambda bag: change_database(bag, "UPDATE messages SET topic_id = 99 WHERE id = 1"),
            "its topics have 11 of 12 messages",
        ),
        (
            lambda bag: change_topics(bag, lambda each: each.remove(topic_of(each, TEXT))),
            "its topics have 9 of 12 messages",
        ),
        (
            lambda bag: change_topics(
                bag, lambda each: topic_of(each, POINTS).update(message_count=2)
            ),
            "more than its index has",
        ),
        (
            lambda bag: change_topics(
                bag, lambda each: topic_of(each, POINTS).update(message_count=4)
            ),
            "than the 4 of its index",
        ),
    ],
)
def test_a_database_with_other_messages_than_its_index_is_not_copied(
    tmp_path, change, reason
) -> None:
    bag = small_bag(tmp_path, "sqlite3")
    change(bag)
    with pytest.raises(InputError, match=reason):
        copied(bag, tmp_path / "out")


def test_a_table_that_ros_2_does_not_know_is_warned_of(tmp_path, capsys) -> None:
    bag = small_bag(tmp_path, "sqlite3")
    change_database(bag, "CREATE TABLE notes(note TEXT)")
    copied(bag, tmp_path / "out")
    assert "'notes'" in capsys.readouterr().err


def of_no_topic(content: bytes) -> bytes:
    """The index of the first chunk's first topic becomes that of a topic that there is not."""
    place = re.search(rb"op=\x04.{16}conn=", content, re.DOTALL).end()
    return content[:place] + b"\x63\0\0\0" + content[place + 4 :]


def without_a_chunk(content: bytes) -> bytes:
    """The chunk is there twice, and the index has one of them."""
    start = content.index(b"\4\0\0\0op=\5") - 4
    index = int.from_bytes(content[(place := content.index(b"index_pos=") + 10) :][:8], "little")
    longer = (index + index - start).to_bytes(8, "little")
    head = content[:place] + longer + content[place + 8 : start]
    return head + content[start:index] * 2 + content[index:]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (of_no_topic, "its index has"),
        (without_a_chunk, "does not name all chunks"),
        (lambda content: ros1_with_index(content, chunk_times=2), "more than once"),
    ],
)
def test_an_index_of_ros_1_that_differs_from_the_chunks_is_refused(
    tmp_path, change, reason
) -> None:
    bag = small_bag(tmp_path, "ros1")
    changed = change(bag.read_bytes())
    assert changed != bag.read_bytes()
    bag.write_bytes(changed)
    with pytest.raises(InputError, match=reason):
        copied(bag, tmp_path / "out")
