"""Facts that ``derain info`` prints about a file: scan, labels, bag, model or checkpoint."""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from derain.bags.bag import Bag
from derain.bags.cloud_topic import CloudTopic
from derain.bags.names import is_bag, split
from derain.bags.point_cloud import DATATYPES
from derain.bags.topics import POINT_CLOUD, Topic, decoder_of
from derain.errors import InputError
from derain.files.labels import read_labels
from derain.files.reading import reading
from derain.scan import Array, Scan, class_ids
from derain.sources.folders import frame_of
from derain.system.extras import CHECKPOINT_LIBRARIES, require
from derain.system.notices import warn
from derain.views.directions import directions
from derain.views.grid_fit import fit_grid
from derain.views.morton import distinct_positions
from derain.views.scan_issues import no_points


def facts_of_file(path: Path, columns: Sequence[str]) -> dict[str, Any]:
    """The facts about a file, by its suffix.

    Args:
        path: The file.
        columns: Names of the columns of files that do not name them.

    Raises:
        InputError: No such file, or one that cannot be read.
    """
    if is_bag(path):
        return _of_bag(path)
    with reading(path):
        exists = path.exists() or split(path) is not None
    if not exists:
        raise InputError(path, "there is no such file or folder", "Check the path.")
    match path.suffix.lower():
        case ".label":
            return _of_labels(path)
        case ".onnx":
            from derain.export.runtime import Derainer

            return Derainer(path, threads=1).metadata
        case ".ckpt":
            require(path, *CHECKPOINT_LIBRARIES)
            from derain.models.checkpoint import load_model

            model = load_model(path)
            weights = sum(parameter.numel() for parameter in model.parameters())
            return {"spec": dict(model.hparams["spec"]), "parameters": weights}
        case ".pt" | ".pth":
            remedy = "Make a checkpoint of them with `derain import-weights`."
            raise InputError(path, "holds weights without the Spec of their use", remedy)
        case _:
            scan = frame_of(path, columns).read()
            for issue in no_points(scan):
                warn(f"{path}: {issue.detail}")
            return _of_scan(scan)


def _of_labels(path: Path) -> dict[str, Any]:
    labels, rest = divmod(path.stat().st_size, 4)
    if rest:
        raise InputError(path, "is not whole labels of 4 bytes", "Make the file again.")
    ids, counts = np.unique(class_ids(read_labels(path, labels)), return_counts=True)
    by_class = dict(zip(map(str, ids), counts.tolist(), strict=True))
    return {"points": labels, "points by class id": by_class}


def _of_scan(scan: Scan) -> dict[str, Any]:
    """A scan's extent and the grid that fits."""
    valid = scan.valid
    points = scan.xyz[valid]
    azimuth, inclination = directions(points)
    facts = {
        "points": len(scan),
        "valid": int(valid.sum()),
        "distinct positions": len(distinct_positions(points)[0]),
        "organised": "no" if scan.shape is None else f"{scan.shape[0]} x {scan.shape[1]}",
        "fields": {name: str(column.dtype) for name, column in scan.fields.items()},
        "x / m": _span(points[:, 0]),
        "y / m": _span(points[:, 1]),
        "z / m": _span(points[:, 2]),
        "range / m": _span(scan.range[valid]),
        "azimuth / deg": _span(azimuth),
        "inclination / deg": _span(inclination),
        "intensity": "none" if scan.intensity is None else _span(scan.intensity[valid]),
        "fitted grid": "none",
    }
    if valid.any():
        fit = fit_grid([scan]).as_dict()
        del fit["grid"]  # one number a row: of use in a configuration, for which there is --grid
        facts["fitted grid"] = fit
    return facts


def _span(values: Array) -> dict[str, float] | str:
    """Bounds and median of the finite values: JSON has no NaN and no infinity."""
    values = values[np.isfinite(values)]
    if not len(values):
        return "none"
    numbers = np.percentile(values, [0, 50, 100]).tolist()
    return {name: round(n, 4) for name, n in zip(("min", "median", "max"), numbers, strict=True)}


def _of_bag(path: Path) -> dict[str, Any]:
    """A bag's topics, and the layout of the first cloud of each topic of clouds."""
    bag = Bag(path)
    with bag.opened() as reader:
        messages, start, seconds = reader.message_count, reader.start_time, 1e-9 * reader.duration
    began = "not known"
    if 0 < start < 2**62:
        began = datetime.fromtimestamp(1e-9 * start, UTC).isoformat(timespec="milliseconds")
    topics, clouds = {}, {}
    for topic in bag.topics:
        decoder = decoder_of(topic.type)
        needs = "" if decoder is None else f"; {decoder} turns it into point clouds"
        topics[topic.name] = f"{topic.type or 'no type'}, {topic.messages:,} messages{needs}"
        if topic.type == POINT_CLOUD and topic.messages:
            clouds[topic.name] = _of_clouds(bag, topic)
    return {
        "bag": bag.storage,
        "messages": messages,
        "from": began,
        "seconds": round(seconds, 3),
        "topics": topics,
        "point clouds": clouds or "none",
    }


def _of_clouds(bag: Bag, topic: Topic) -> dict[str, Any]:
    """The layout of the first cloud of a topic, which mostly represents all."""
    try:
        cloud = CloudTopic(bag, topic).cloud(0).cloud
    except InputError as error:
        return {"first": str(error)}
    fields = {}
    for field in cloud.fields:
        count = f" x {field.count}" if field.count > 1 else ""
        fields[field.name or "(padding)"] = f"{DATATYPES[field.datatype]}{count} at {field.offset}"
    return {
        "points of the first": len(cloud),
        "organised": f"{cloud.height} x {cloud.width}" if cloud.is_organised else "no",
        "bytes per point": cloud.point_step,
        "byte order": "big-endian" if cloud.is_bigendian else "little-endian",
        "fields": fields,
    }
