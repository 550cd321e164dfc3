"""Checks what the chunks of a LAZ file expand to, for its library allocates whatever they state.

Source: LASzip, "LASzip compressed point data", the record of user id "laszip encoded" and the
layered chunks of point formats 6 to 10.
"""

import struct

from derain.files.content import Content

# Layers of an item of a point, by the item's type: a point, colours, near infrared, waveforms.
_LAYERS = {10: 9, 11: 1, 12: 2, 13: 1}

# Further bytes have a layer each.
_BYTES = 14


def check_chunks(content: Content, record: bytes, size: int, begin: int) -> None:
    """Refuses a LAZ file whose chunks do not lie in it.

    Args:
        content: The file.
        record: The variable-length record that says how the points are compressed.
        size: Bytes of a point.
        begin: Where the compressed points begin.

    Raises:
        ValueError: Points of another size than the header's, more chunks than the file can hold, or
            a layer that is not in it.
        struct.error: A file that is cut off.
    """
    items = list(struct.iter_unpack("<HHH", record[34:]))
    (stated,) = struct.unpack_from("<H", record, 32)
    if stated != len(items) or sum(item_size for _, item_size, _ in items) != size:
        raise ValueError("compressed points of another size than the header's")
    data = content.data
    (table,) = struct.unpack_from("<q", data, begin)
    if table == -1:  # the file was written as a stream
        (table,) = struct.unpack_from("<q", data, len(data) - 8)
    if not begin < table < len(data):
        raise ValueError("the table of chunks is not in the file")
    _, chunks = struct.unpack_from("<II", data, table)
    if chunks > len(data):
        raise ValueError(f"{chunks:,} chunks in the header")
    layers = sum(
        item_size if kind == _BYTES else _LAYERS.get(kind, 0) for kind, item_size, _ in items
    )
    if layers:
        _check_layers(data, begin + 8, table, size, layers)


def _check_layers(data: bytes, begin: int, end: int, size: int, layers: int) -> None:
    """Refuses chunks whose layers are not in the file.

    A chunk is its first point, the number of its points, the sizes of its layers, and the layers.
    """
    while begin < end:
        place = begin + size + 4
        sizes = struct.unpack_from(f"<{layers}I", data, place)
        begin = place + 4 * layers + sum(sizes)
    if begin > end:
        raise ValueError("a chunk that is not in the file")
