"""Bags of ROS 2 whose files are compressed as a whole, unpacked once for all who read them."""

import shutil
import tempfile
import weakref
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from weakref import WeakValueDictionary

from derain.bags.ros2_metadata import Ros2Metadata
from derain.files.temporary import temporary_folder
from derain.system.extras import ZSTANDARD

# What is written at once, and what is left on the disk for others, bytes.
PORTION, LEFT = 2**22, 2**30


@dataclass(frozen=True, eq=False)
class UnpackedBag:
    """A folder with the files of a compressed bag, not compressed.

    It is removed when the process that unpacked the bag ends or holds this no more. Pickled, it is
    the path alone: another process reads the folder and leaves it.

    Attributes:
        path: The folder.
    """

    path: Path


# What this process has unpacked and holds, by the bag's files as they were then.
_HELD: WeakValueDictionary[tuple[object, ...], UnpackedBag] = WeakValueDictionary()


def unpacked_bag(folder: Path, metadata: Ros2Metadata) -> UnpackedBag:
    """The same bag with files that are not compressed; unpacked unless this process holds it.

    Args:
        folder: The bag's folder.
        metadata: What its metadata.yaml says.

    Raises:
        ValueError: A damaged file, or one that unpacks to more than there is room for.
        OSError: It cannot be read, or the other not written.
    """
    files = [(folder / name).stat() for name in metadata.files]
    key = (*((f.st_dev, f.st_ino, f.st_size, f.st_mtime_ns) for f in files), repr(metadata))
    held = _HELD.get(key)
    if held is not None:
        return held
    with ExitStack() as stack:
        lent = stack.enter_context(temporary_folder(Path(tempfile.gettempdir())))
        lent.chmod(0o700)  # others may look into the folder that it is in
        plain = metadata.unpacked()
        for packed, file in zip(metadata.files, plain.files, strict=True):
            _unpack(folder / packed, lent / file)
        plain.write(lent)
        made = _HELD[key] = UnpackedBag(lent)
        weakref.finalize(made, stack.pop_all().close)
        return made


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
