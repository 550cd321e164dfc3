"""Bags of ROS 2 whose files are compressed as a whole, unpacked for as long as they are read."""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from derain.bags.ros2_metadata import Ros2Metadata
from derain.files.temporary import temporary_folder
from derain.system.extras import ZSTANDARD

# What is written at once, and what is left on the disk for others, bytes.
PORTION, LEFT = 2**22, 2**30


@contextmanager
def unpacked_files(folder: Path, metadata: Ros2Metadata) -> Iterator[Path]:
    """Lends a folder with the same bag, whose files are not compressed.

    Args:
        folder: The bag's folder.
        metadata: What its metadata.yaml says.

    Raises:
        ValueError: A damaged file, or one that unpacks to more than there is room for.
        OSError: It cannot be read, or the other not written.
    """
    with temporary_folder(Path(tempfile.gettempdir())) as lent:
        lent.chmod(0o700)  # others may look into the folder that it is in
        plain = metadata.unpacked()
        for packed, file in zip(metadata.files, plain.files, strict=True):
            _unpack(folder / packed, lent / file)
        plain.write(lent)
        yield lent


def _unpack(source: Path, target: Path) -> None:
    zstandard = ZSTANDARD.load(source)
    with source.open("rb") as packed, target.open("xb") as unpacked:
        try:
            with zstandard.ZstdDecompressor().stream_reader(packed) as reader:
                while portion := reader.read(PORTION):
                    if shutil.disk_usage(target.parent).free < LEFT + len(portion):
                        raise ValueError(
                            f"{source.name} unpacks to more than there is room for in "
                            f"{target.parent.parent}"
                        )
                    unpacked.write(portion)
        except zstandard.ZstdError as error:
            raise ValueError(f"{source.name} is damaged: {error}") from error
