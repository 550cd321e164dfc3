"""A bag with other messages than its index states is not copied."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from small_bags import change_database, change_metadata, copied, small_bag, topic_of

from benchmarks.fuzzing.false_indexes import ros1_with_index
from benchmarks.recorded_bags import POINTS, TEXT
from derain.errors import InputError


def without_text(information: dict[str, Any]) -> None:
    information["topics_with_message_count"].remove(topic_of(information, TEXT))


def stating(clouds: int) -> Callable[[Path], None]:
    """The index names so many clouds, of which there are three."""

    def change(bag: Path) -> None:
        change_metadata(bag, lambda each: topic_of(each, POINTS).update(message_count=clouds))

    return change


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (
            lambda bag: change_database(bag, "UPDATE messages SET topic_id = 99 WHERE id = 1"),
            "its topics have 11 of 12 messages",
        ),
        (lambda bag: change_metadata(bag, without_text), "its topics have 9 of 12 messages"),
        (stating(2), "than the 2 of its index"),
        (stating(4), "than the 4 of its index"),
    ],
)
def test_a_database_with_other_messages_than_its_index_is_not_copied(
    tmp_path, change, reason
) -> None:
    bag = small_bag(tmp_path, "sqlite3")
    change(bag)
    with pytest.raises(InputError, match=reason):
        copied(bag, tmp_path / "out")


def test_a_topic_that_the_metadata_lack_is_named(tmp_path) -> None:
    bag = small_bag(tmp_path, "mcap")
    change_metadata(bag, without_text)
    with pytest.raises(InputError, match=f"metadata.yaml lacks the topic {TEXT}"):
        copied(bag, tmp_path / "out")


def of_no_topic(content: bytes) -> bytes:
    """The index of the first chunk's first topic becomes that of a topic that there is not."""
    place = re.search(rb"op=\x04.{16}conn=", content, re.DOTALL).end()
    return content[:place] + b"\x63\0\0\0" + content[place + 4 :]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (of_no_topic, "of 12 messages"),
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
