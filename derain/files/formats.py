"""The formats of scan files: what reads and writes each of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from derain.errors import InputError
from derain.files.binary import decode_binary, encode_binary
from derain.files.content import Content
from derain.files.feather import decode_feather, encode_feather
from derain.files.las import decode_las, encode_las
from derain.files.names import scan_suffix
from derain.files.numpy_arrays import decode_npy, decode_npz, encode_npy, encode_npz
from derain.files.pcd import decode_pcd, encode_pcd
from derain.files.ply import decode_ply, encode_ply
from derain.files.table import decode_table, encode_table
from derain.scan import Scan


@dataclass(frozen=True)
class Format:
    """A format of scan files.

    Attributes:
        decode: Makes a scan of a file's content and of the names of its columns, which count where
            the file does not name them itself. Content that it cannot read raises InputError.
        encode: The content of a file for a scan; the path is for messages. A scan that the format
            cannot hold raises InputError.
        record: How likely such a file is a record of something else, such as of poses: of a
            folder's files those of the lowest number are its scans.
    """

    decode: Callable[[Content, Sequence[str]], Scan]
    encode: Callable[[Path, Scan], bytes]
    record: int = 0


def _naming(decode: Callable[[Content], Scan]) -> Callable[[Content, Sequence[str]], Scan]:
    """The reader of a format that always names its columns itself."""
    return lambda content, _: decode(content)


FORMATS = {
    ".bin": Format(decode_binary, encode_binary),
    ".npy": Format(decode_npy, encode_npy),
    ".npz": Format(decode_npz, encode_npz),
    ".pcd": Format(_naming(decode_pcd), encode_pcd),
    ".ply": Format(_naming(decode_ply), encode_ply),
    ".csv": Format(decode_table, encode_table, record=1),
    ".txt": Format(decode_table, encode_table, record=2),
    ".xyz": Format(decode_table, encode_table),
    ".asc": Format(decode_table, encode_table),
    ".feather": Format(_naming(decode_feather), encode_feather),
    ".las": Format(_naming(decode_las), encode_las),
    ".laz": Format(_naming(decode_las), encode_las),
}


def format_of(path: Path) -> Format:
    """The format of a file, by its suffix.

    Raises:
        InputError: No format has this suffix.
    """
    suffix = scan_suffix(path)
    if suffix not in FORMATS:
        raise InputError(
            path,
            f"'{suffix}' is not the suffix of a scan",
            f"Known are {', '.join(FORMATS)}, and each of them with .gz.",
        )
    return FORMATS[suffix]
