"""Columns in Arrow's file format (`.feather`, version 2), read and written by PyArrow; Argoverse 2.

Source: Apache Arrow, "Arrow Columnar Format", version 1.5, section on IPC.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.columns import columns_of, scan_of
from derain.files.content import Content, check_columns
from derain.files.format import FORMATS, Format
from derain.files.reading import reading
from derain.scan import Scan
from derain.system.extras import FLATBUFFERS, PYARROW, require

# What the file begins with; what follows is a stream of messages.
_MAGIC = b"ARROW1\0\0"


@dataclass(frozen=True, eq=False)
class FeatherHeader:
    """What a Feather file holds besides numbers: text, missing values, what the schema says.

    Attributes:
        table: The file, a pyarrow.Table with a row for each point.
        compression: How it is compressed: "uncompressed", "lz4" or "zstd".
    """

    table: Any
    compression: str

    def take(self, rows: NDArray[Any]) -> "FeatherHeader":
        """The table of some of the points only."""
        return replace(self, table=self.table.take(np.arange(self.table.num_rows)[rows]))


@FORMATS.add(".feather")
class Feather(Format):
    """Tables in Arrow's file format, compressed or not."""

    HELP = "Arrow tables, version 2"
    EXTRA = PYARROW

    def decode(self, content: Content, columns: Sequence[str]) -> Scan:
        """Reads a Feather file.

        Args:
            content: The file, version 2.
            columns: Not used: a table names its columns.

        Returns:
            The scan. Its fields are the columns of numbers; a missing number is NaN, which makes a
            column of whole numbers float64.

        Raises:
            InputError: A file that is damaged, or has no coordinates; PyArrow is not installed.
        """
        arrow = PYARROW.load(content.path)
        require(content.path, FLATBUFFERS)
        from derain.files.formats.feather.arrow_messages import check_messages

        with reading(content.path, Exception):
            if not content.data.startswith(_MAGIC):
                raise ValueError("it does not begin as Feather version 2 does")
            # As a stream, so that what is read are the messages that were checked.
            stream = content.data[len(_MAGIC) :]
            compression = check_messages(arrow, stream, content.budget)
            with arrow.ipc.open_stream(stream) as messages:
                table = messages.read_all()
            table.validate(full=True)
            check_columns(table.num_columns)
            content.budget.reserve(table.nbytes)
            if len(set(table.column_names)) < table.num_columns:
                raise ValueError("two columns have one name")
            fields = {
                name: column.to_numpy()
                for name, column in zip(table.column_names, table.columns, strict=True)
                if arrow.types.is_integer(column.type) or arrow.types.is_floating(column.type)
            }
        return scan_of(content.path, fields, header=FeatherHeader(table, compression))

    def encode(self, path: Path, scan: Scan) -> bytes:
        """A scan's columns in the order, types and compression of the file that it came from.

        Raises:
            InputError: A column that no table can hold; PyArrow is not installed.
        """
        arrow = PYARROW.load(path)
        feather = PYARROW.load(path, "feather")
        header = scan.header if isinstance(scan.header, FeatherHeader) else None
        if header is not None and header.table.num_rows != len(scan):
            header = None
        held = {name: header.table[name] for name in header.table.column_names} if header else {}
        for name, column in columns_of(scan).items():
            if column.ndim > 1 or column.dtype.kind not in "biuf" or column.dtype.itemsize > 8:
                raise InputError(
                    path, f".feather has no place for the column '{name}'", "Write .npz."
                )
            exact = column.dtype.kind == "f"
            if name not in held or not np.array_equal(
                held[name].to_numpy(), column, equal_nan=exact
            ):
                held[name] = arrow.array(column.astype(column.dtype.newbyteorder("=")))
        table = arrow.table(held)
        if header is not None:
            table = table.replace_schema_metadata(header.table.schema.metadata)
        sink = arrow.BufferOutputStream()
        feather.write_feather(table, sink, header.compression if header else "lz4")
        return bytes(sink.getvalue())
