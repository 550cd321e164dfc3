"""The metadata.yaml of a bag of ROS 2: which files it has, and how they are compressed."""

import os
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from typing import Any

import yaml

from derain.bags.names import BAG_METADATA, METADATA_WORD
from derain.errors import reason_of
from derain.files.documents import LARGEST_DOCUMENT, parsed_yaml

# The newest version that derain reads, which writes quality of service in words, and the one before
# it, which writes numbers as text.
NEWEST_VERSION, OLDER_VERSION = 9, 8

STORAGES = ("sqlite3", "mcap")

# Modes of compression: none, of each message, of each file.
NONE, MESSAGE, FILE = "", "message", "file"


@dataclass(frozen=True)
class Ros2Metadata:
    """The content of a metadata.yaml.

    Attributes:
        content: All of it, below its one key.
        version: Version of its format.
        storage: ``sqlite3`` or ``mcap``.
        files: Names of its files, in the order of time.
        compression: ``""``, ``message`` or ``file``; the compression is zstd.
    """

    content: dict[str, Any]
    version: int
    storage: str
    files: tuple[str, ...]
    compression: str

    @classmethod
    def read(cls, folder: Path) -> "Ros2Metadata":
        """Reads that of a bag.

        Raises:
            ValueError: It is no small YAML, has values that no bag of ROS 2 has, or lists files
                that do not exist.
            OSError: It cannot be read.
        """
        with (folder / BAG_METADATA).open("rb") as file:
            text = file.read(LARGEST_DOCUMENT + 1).decode("utf-8")
        try:
            document = parsed_yaml(text, aliases=True)
            content = document[METADATA_WORD.decode()]
            version, storage = int(content["version"]), str(content["storage_identifier"])
            files = tuple(PurePath(name).name for name in content["relative_file_paths"])
            mode = str(content.get("compression_mode") or "").lower().replace("none", NONE)
            packing = str(content.get("compression_format") or "")
            for topic in content["topics_with_message_count"]:
                int(topic["message_count"]), topic["topic_metadata"]["name"]
        except KeyError as error:
            raise ValueError(f"its {BAG_METADATA} lacks {error}") from error
        except Exception as error:  # PyYAML has many
            raise ValueError(f"its {BAG_METADATA} is damaged: {reason_of(error)}") from error
        if version > NEWEST_VERSION:
            raise ValueError(f"version {version} of {BAG_METADATA} is not known")
        if storage not in STORAGES:
            raise ValueError(f"the storage '{storage}' is not known")
        if mode not in (NONE, MESSAGE, FILE) or (mode and packing != "zstd"):
            raise ValueError(f"the compression '{packing}' by {mode} is not known")
        missing = [name for name in files if not os.path.isfile(folder / name)]
        if missing or not files:
            raise ValueError(f"its file {', '.join(missing) or 'of messages'} is missing")
        return cls(content, version, storage, files, mode)

    def unpacked(self) -> "Ros2Metadata":
        """The metadata of the same bag after its files are unpacked."""
        files = tuple(PurePath(name).stem for name in self.files)
        content = self.content | {
            "relative_file_paths": list(files),
            "compression_mode": NONE,
            "compression_format": "",
        }
        return replace(self, content=content, files=files, compression=NONE)

    def topic(self, name: str) -> dict[str, Any]:
        """The metadata of a topic.

        Raises:
            ValueError: There are none.
        """
        for each in self.content["topics_with_message_count"]:
            if each["topic_metadata"]["name"] == name:
                return dict(each["topic_metadata"])
        raise ValueError(f"its {BAG_METADATA} lacks the topic {name}")

    def write(self, folder: Path) -> None:
        """Writes it to a folder."""
        text = yaml.safe_dump({METADATA_WORD.decode(): self.content}, sort_keys=False)
        (folder / BAG_METADATA).write_text(text, "utf-8")
