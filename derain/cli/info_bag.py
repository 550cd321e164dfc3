"""What ``derain info`` prints of a bag: its topics, and the layout of their first clouds."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from derain.bags.bag import Bag
from derain.bags.cloud_topic import CloudTopic
from derain.bags.point_cloud import DATATYPES, PointField
from derain.bags.topics import POINT_CLOUD, Topic, decoder_of
from derain.errors import InputError


def facts_of_bag(path: Path) -> dict[str, Any]:
    """What is in a bag.

    Args:
        path: The bag.

    Raises:
        InputError: A bag that cannot be read.
    """
    bag = Bag(path)
    with bag.opened() as reader:
        storage, messages = bag.storage, reader.message_count
        start, seconds = reader.start_time, 1e-9 * reader.duration
    return {
        "bag": storage,
        "messages": messages,
        "from": datetime.fromtimestamp(1e-9 * start, UTC).isoformat(timespec="milliseconds")
        if 0 < start < 2**62
        else "not known",
        "seconds": round(seconds, 3),
        "topics": {topic.name: _of_topic(topic) for topic in bag.topics},
        "point clouds": {
            topic.name: _of_clouds(CloudTopic(bag, topic))
            for topic in bag.topics
            if topic.type == POINT_CLOUD and topic.messages
        }
        or "none",
    }


def _of_topic(topic: Topic) -> str:
    decoder = decoder_of(topic.type)
    told = "" if decoder is None else f"; no point clouds before {decoder} makes them"
    return f"{topic.type or 'no type'}, {topic.messages:,} messages{told}"


def _of_clouds(clouds: CloudTopic) -> dict[str, Any]:
    """What the first cloud of a topic is, which mostly stands for all."""
    try:
        cloud = clouds.cloud(0).cloud
    except InputError as error:
        return {"first": str(error)}
    return {
        "points of the first": len(cloud),
        "organised": f"{cloud.height} x {cloud.width}" if cloud.is_organised else "no",
        "bytes per point": cloud.point_step,
        "byte order": "big-endian" if cloud.is_bigendian else "little-endian",
        "fields": {field.name or "(padding)": _type_of(field) for field in cloud.fields},
    }


def _type_of(field: PointField) -> str:
    count = f" x {field.count}" if field.count > 1 else ""
    return f"{DATATYPES[field.datatype]}{count} at {field.offset}"
