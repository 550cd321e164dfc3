"""The ONNX contract in NumPy: runs a model as derain does, without derain.

It follows ``docs/onnx_contract.md`` step by step and searches by brute force, which takes minutes
for a whole scan: it is there to port from, and to check a port against::

    python examples/onnx_reader.py MODEL.onnx SCAN.bin OUT.label
"""

import hashlib
import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
from numpy.typing import NDArray

Points = NDArray[np.float32]  # (N, 4): x, y, z in metres, sensor frame; intensity
Spec = dict[str, Any]

LARGEST_COORDINATE, LARGEST_VALUE, SENTINEL, FEWEST_ALIKE = 1e6, 1e7, -1.0, 100
MOST_COPIES = 20

# Steps within 5 × 5 pixels: to the pixel itself, then the nearest, then row by row.
STEPS = sorted(
    ((row, column) for row in range(-2, 3) for column in range(-2, 3)),
    key=lambda step: (step[0] ** 2 + step[1] ** 2, step),
)
VOTERS, CUTOFF = 5, 1.0

# Of the isolated view: the same constants as the contract's.
SAMPLED, STEP_NEIGHBOURS, FINEST_STEP, USUAL_STEP, NEAREST_POINT = 8192, 3, 1e-4, 0.1, 0.05
AROUND, HALF_AT, MOST_CROWDED = 8, 2.0, 6.5
RANGE_RESOLUTION, SAME_RAY = 0.05, 4e-4
RANKS = 32
SHELL_EDGES = np.square(np.geomspace(1, 60, 12)[1:-1]).astype(np.float32)


class Model:
    """A model that ``derain export`` wrote.

    Args:
        path: The ONNX file.
    """

    def __init__(self, path: str) -> None:
        self.session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
        metadata = self.session.get_modelmeta().custom_metadata_map
        known = json.loads(metadata["derain"])
        self.spec: Spec = known["spec"]
        if not is_as_exported(Path(path).read_bytes(), known):
            raise SystemExit(f"{path}: its checksum differs or is missing")
        views = {
            "neighbours": self._by_neighbours,
            "range": self._by_image,
            "isolated_points": self._of_isolated,
        }
        kind = self.spec["view"]["kind"]
        gone = "dual_return" in self.spec["channels"]
        if self.spec.get("schema", 1) > 1 or kind not in views or gone:
            raise SystemExit(f"{path}: its Spec asks for what this reader does not know")
        self.judge = views[kind]

    def rain(self, points: Points) -> NDArray[np.bool_]:
        """True for rain, bool (N,), in the order of the points."""
        return self.judge(points) > np.float32(self.spec.get("threshold", 0.5))

    def _by_neighbours(self, points: Points) -> NDArray[np.float32]:
        inputs, inverse = neighbour_view(points, self.spec)
        of_points = np.zeros(len(inputs["points"]) + 1, np.float32)  # the last for invalid rows
        scored: Any = slice(0, -1)
        if "candidates" in inputs:
            scored = inputs["neighbours"][: len(inputs["candidates"]), 0]
        of_points[scored] = self._probability(inputs)
        return of_points[inverse]

    def _of_isolated(self, points: Points) -> NDArray[np.float32]:
        """Rows without a possible intensity are judged as in a scan that has none."""
        blank = points.copy()
        blank[:, 3] = np.nan
        dark = valid_rows(blank) & ~valid_rows(points)
        result = self._of_isolated_of_valid(points)
        if dark.any():
            result[dark] = self._of_isolated_of_valid(blank)[dark]
        return result

    def _of_isolated_of_valid(self, points: Points) -> NDArray[np.float32]:
        inputs, inverse = isolated_view(points, self.spec)
        of_points = np.zeros(len(inputs["points"]) + 1, np.float32)  # the last for invalid rows
        of_points[inputs["neighbours"][:, 0]] = self._probability(inputs)
        return of_points[inverse]

    def _by_image(self, points: Points) -> NDArray[np.float32]:
        inputs, pixel, winner = range_view(points, self.spec)
        candidate = candidate_rows(points, self.spec)
        shown_is_candidate = np.append(candidate, False)[winner]
        score = np.where(shown_is_candidate, self._probability(inputs), np.float32(0))
        judged = np.flatnonzero((pixel >= 0) & candidate)
        result = np.zeros(len(points), np.float32)
        result[judged] = back_projection(points, pixel, winner, score, self.spec)[judged]
        return result

    def _probability(self, inputs: dict[str, NDArray[Any]]) -> NDArray[np.float32]:
        (logits,) = self.session.run(["logits"], inputs)
        margin = logits[:, 1].astype(np.float64) - logits[:, 0]
        return (0.5 + 0.5 * np.tanh(0.5 * margin)).astype(np.float32)


def is_as_exported(content: bytes, known: dict[str, Any]) -> bool:
    """True if the checksum is right; it is missing only in files laid out as derain 0.1's were."""
    if "sha256" not in known:
        early = known.keys() <= {"spec", "versions", "proof"}
        return early and not known["spec"].keys() & {"candidates", "training"}
    before, stated, after = content.rpartition(str(known["sha256"]).encode())
    return hashlib.sha256(before + b"0" * 64 + after).hexdigest() == stated.decode()


def valid_rows(points: Points) -> NDArray[np.bool_]:
    """Rows that can be judged."""
    xyz, intensity = points[:, :3], points[:, 3]
    with np.errstate(invalid="ignore"):
        valid: NDArray[np.bool_] = (np.abs(xyz) <= LARGEST_COORDINATE).all(axis=1)
        empty = (xyz == SENTINEL).all(axis=1)
        if knows_intensity(points):
            valid &= np.abs(intensity) <= LARGEST_VALUE
            empty &= intensity == SENTINEL
    valid &= ~(xyz == 0).all(axis=1) & ~empty
    return valid


def knows_intensity(points: Points) -> bool:
    """True if any intensity is one that a sensor can measure."""
    with np.errstate(invalid="ignore"):
        return bool((np.abs(points[:, 3]) <= LARGEST_VALUE).any())


def channel(points: Points, name: str) -> NDArray[np.float32] | None:
    """One value per row; None where the scan has no such channel."""
    if name in ("x", "y", "z"):
        return points[:, "xyz".index(name)]
    if name == "range":
        with np.errstate(invalid="ignore"):
            x, y, z = points[:, :3].T.astype(np.float64)
            return np.sqrt(x * x + y * y + z * z).astype(np.float32)
    if name == "intensity" and knows_intensity(points):
        measured = points[valid_rows(points), 3]
        alike = len(measured) >= FEWEST_ALIKE and measured.min() == measured.max()
        return None if alike else points[:, 3]
    return None


def channels(points: Points, rows: NDArray[np.int64], spec: Spec) -> NDArray[np.float32]:
    """The network's input channels of some rows, float32 (M, C); means replace missing values."""
    columns = []
    for name, mean in zip(spec["channels"], spec["mean"], strict=True):
        values = channel(points, name)
        column = np.full(len(rows), np.nan, np.float32) if values is None else values[rows]
        columns.append(np.where(np.isnan(column), np.float32(mean), column))
    return np.stack(columns, axis=1)


def candidate_rows(points: Points, spec: Spec) -> NDArray[np.bool_]:
    """Rows that may be rain: all, where the Spec has no candidates."""
    candidate = np.ones(len(points), bool)
    for bound in (spec.get("candidates") or {"bounds": []})["bounds"]:
        values = channel(points, bound["channel"])
        if values is not None:
            for limit, outside in ((bound["least"], np.less), (bound["most"], np.greater)):
                if limit is not None:
                    candidate &= ~outside(values, np.float32(limit))
    return candidate


def neighbour_view(points: Points, spec: Spec) -> tuple[dict[str, NDArray[Any]], NDArray[np.int64]]:
    """The inputs of a point network, and the point of each row, -1 for those at none."""
    first, inverse = distinct_points(points)
    every, k = np.arange(len(first)), spec["view"]["neighbours"]
    neighbours, distances = nearest(points, first, every, k)
    inputs: dict[str, NDArray[Any]] = {
        "points": channels(points, first, spec),
        "neighbours": neighbours,
        "distances": distances,
    }
    if spec.get("candidates"):
        inputs |= around_candidates(candidate_rows(points, spec)[first], neighbours, distances)
    return inputs, inverse


def distinct_points(points: Points) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows of the distinct positions along the curve, and of each row its position's number."""
    rows = along_the_curve(points, np.flatnonzero(valid_rows(points)))
    elsewhere = np.ones(len(rows), bool)
    elsewhere[1:] = (points[rows[1:], :3] != points[rows[:-1], :3]).any(axis=1)
    position = np.cumsum(elsewhere) - 1
    are_copies = np.bincount(position)[position] <= MOST_COPIES
    rows, elsewhere = rows[are_copies], elsewhere[are_copies]
    first, inverse = rows[elsewhere], np.full(len(points), -1)
    inverse[rows] = np.cumsum(elsewhere) - 1
    return first, inverse


def along_the_curve(points: Points, rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """The rows along a Morton curve; in one cell by z, y and x, and at one position by number."""
    if not len(rows):
        return rows
    x, y, z = points[rows, :3].T
    offset = np.stack([x, y, z]).astype(np.float64)
    offset -= offset.min(axis=1, keepdims=True)
    side = offset.max()
    cell = (offset * (65535 / side if side > 0 else 0.0)).astype(np.int64)
    code = np.zeros(len(rows), np.int64)
    for bit in range(16):
        for axis in range(3):
            code |= (cell[axis] >> bit & 1) << (3 * bit + axis)
    return rows[np.lexsort((rows, x, y, z, code))]


def nearest(
    points: Points, first: NDArray[np.int64], some: NDArray[np.int64], k: int
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Of some of the points the k nearest, itself first; of equally near ones, lower rows first."""
    xyz = points[first, :3].astype(np.float64)
    neighbours = np.empty((len(some), k), np.int64)
    squared = np.empty((len(some), k))
    for number, place in enumerate(xyz[some]):
        away = ((xyz - place) ** 2).T
        every = away[0] + away[1] + away[2]
        order = np.lexsort((first, every))[:k]
        order = np.append(order, np.repeat(order[-1], k - len(order)))  # fewer points than k
        neighbours[number], squared[number] = order, every[order]
    return neighbours, np.sqrt(squared.astype(np.float32))


def around_candidates(
    candidate: NDArray[np.bool_], neighbours: NDArray[np.int64], distances: NDArray[np.float32]
) -> dict[str, NDArray[Any]]:
    """The neighbourhoods of candidates, then of the others in them, and where each one's lie."""
    own = np.flatnonzero(candidate)
    others = np.setdiff1d(neighbours[own], own)
    needed = np.concatenate([own, others])
    place = np.full(len(candidate), -1)
    place[needed] = np.arange(len(needed))
    return {
        "neighbours": neighbours[needed],
        "distances": distances[needed],
        "candidates": place[neighbours[own]],
    }


def isolated_view(points: Points, spec: Spec) -> tuple[dict[str, NDArray[Any]], NDArray[np.int64]]:
    """The inputs of a network of isolated points; the point of each row, -1 for those at none."""
    first, inverse = distinct_points(points)
    step, doubled = sampled(points, first)
    if doubled:
        first, inverse = merged(points, first, inverse)
        step, _ = sampled(points, first)
    xyz = points[first, :3]
    isolated = np.flatnonzero(crowding(xyz, step) <= MOST_CROWDED)
    neighbours, distances = nearest(points, first, isolated, spec["view"]["neighbours"])
    x, y, z = xyz.T
    shell = np.searchsorted(SHELL_EDGES, x * x + y * y + z * z, side="right")
    cell = shell * RANKS + intensity_ranks(points)[first]
    counts = np.bincount(cell, minlength=(len(SHELL_EDGES) + 1) * RANKS)
    inputs = {
        "points": xyz,
        "cell": cell,
        "distances": distances,
        "neighbours": neighbours,
        "step": np.float32([step]),
        "counts": counts.reshape(1, -1, RANKS).astype(np.float32),
    }
    return inputs, inverse


def sampled(points: Points, first: NDArray[np.int64]) -> tuple[float, bool]:
    """The angle between beams, radians, and whether returns are written more than once."""
    some = np.unique(np.arange(SAMPLED) * len(first) // SAMPLED)[: len(first)]
    neighbours, distances = nearest(points, first, some, 1 + STEP_NEIGHBOURS)
    xyz = points[first, :3].astype(np.float64)
    doubled = bool(one_return(xyz, neighbours, distances).any())
    if len(first) <= STEP_NEIGHBOURS:
        return USUAL_STEP, doubled
    length = np.sqrt((xyz * xyz).sum(axis=1))
    directions = xyz / np.maximum(length, NEAREST_POINT)[:, None]
    apart = directions[neighbours[:, 1:]] - directions[neighbours[:, :1]]
    widest = (apart * apart).sum(axis=2).max(axis=1)
    return max(float(np.sqrt(np.median(widest))), FINEST_STEP), doubled


def one_return(
    xyz: NDArray[np.float64], neighbours: NDArray[np.int64], distances: NDArray[np.float32]
) -> NDArray[np.bool_]:
    """True for neighbours that are one return with the point itself, bool (Q, k - 1)."""
    length = np.linalg.norm(xyz, axis=1)
    own, others = length[neighbours[:, :1]], length[neighbours[:, 1:]]
    apart, farther = distances[:, 1:].astype(np.float64), others - own
    near = (apart <= 2 * RANGE_RESOLUTION) & (np.abs(farther) <= RANGE_RESOLUTION)
    aside = apart * apart - farther * farther
    one: NDArray[np.bool_] = near & (aside <= SAME_RAY * SAME_RAY * own * others)
    return one & (neighbours[:, 1:] != neighbours[:, :1])


def merged(
    points: Points, first: NDArray[np.int64], inverse: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The same with one point for each return: the one of the lowest row."""
    neighbours, distances = nearest(points, first, np.arange(len(first)), 1 + STEP_NEIGHBOURS)
    own, place = np.nonzero(one_return(points[first, :3].astype(np.float64), neighbours, distances))
    other, lowest = neighbours[own, place + 1], first.copy()
    np.minimum.at(lowest, own, first[other])
    np.minimum.at(lowest, other, first[own])
    number = np.full(len(points), -1)
    number[first] = np.arange(len(first))
    keeper = number[lowest]
    while (keeper[keeper] != keeper).any():
        keeper = keeper[keeper]
    kept = np.flatnonzero(keeper == np.arange(len(first)))
    return first[kept], np.append(np.searchsorted(kept, keeper), -1)[inverse]


def crowding(xyz: Points, step: float) -> NDArray[np.float32]:
    """How crowded each point and the least crowded one near it are, float32 (M,)."""
    x, y, z = xyz.T
    squared = np.maximum(x * x + y * y + z * z, np.float32(NEAREST_POINT**2))
    per_half = 1 / (squared * np.float32((HALF_AT * step) ** 2))
    near = np.zeros(len(xyz), np.float32)
    reach = range(1, min(AROUND, len(xyz) - 1) + 1)
    for apart in reach:
        x, y, z = (xyz[apart:] - xyz[:-apart]).T
        distance = x * x + y * y + z * z
        near[:-apart] += 1 / (1 + distance * per_half[:-apart])
        near[apart:] += 1 / (1 + distance * per_half[apart:])
    least = near.copy()
    for apart in reach:
        least[:-apart] = np.minimum(least[:-apart], near[apart:])
        least[apart:] = np.minimum(least[apart:], near[:-apart])
    return near + least


def intensity_ranks(points: Points) -> NDArray[np.int64]:
    """Ranks of intensities, in which each level counts by the root of its points, int64 (N,)."""
    intensity = channel(points, "intensity")
    if intensity is None:
        return np.zeros(len(points), np.int64)
    levels, numbers = np.unique(intensity[valid_rows(points)], return_counts=True)
    darker = np.append(0, np.cumsum(np.sqrt(numbers)))
    steps = np.arange(1, RANKS) / RANKS * darker[-1]
    edges = np.append(levels, np.float32(np.inf))[np.searchsorted(darker[:-1], steps)]
    return np.searchsorted(edges, intensity, side="right")


def range_view(
    points: Points, spec: Spec
) -> tuple[dict[str, NDArray[Any]], NDArray[np.int64], NDArray[np.int64]]:
    """The inputs of an image network; each row's pixel; the row that each pixel shows; -1: none."""
    grid = spec["view"]["grid"]
    shape = len(grid["edges"]) - 1, grid["columns"]
    pixel = np.full(len(points), -1)
    winner = np.full(math.prod(shape), -1)
    distance = channel(points, "range")
    assert distance is not None
    for row in np.flatnonzero(valid_rows(points)):
        pixel[row] = pixel_of(points[row, :3].astype(np.float64), grid)
        shown = winner[pixel[row]]
        if pixel[row] >= 0 and (shown < 0 or distance[row] < distance[shown]):
            winner[pixel[row]] = row
    returned = winner >= 0
    image = np.zeros((math.prod(shape), len(spec["channels"])), np.float32)
    image[returned] = channels(points, winner[returned], spec)
    inputs = {
        "image": np.ascontiguousarray(image.T).reshape(1, -1, *shape),
        "valid": returned.reshape(1, 1, *shape),
    }
    return inputs, pixel, winner


def pixel_of(place: NDArray[np.float64], grid: dict[str, Any]) -> int:
    """The pixel of a direction, row · W + column; -1 outside the grid."""
    x, y, z = (place + 0.0).tolist()  # -0 becomes 0
    azimuth = math.degrees(math.atan2(y, x))
    inclination = math.degrees(math.atan2(z, math.sqrt(x * x + y * y)))
    edges, (right, left) = grid["edges"], grid["azimuth"]
    width: int = grid["columns"]
    from_left = (left - azimuth) % 360.0
    if not edges[-1] <= inclination <= edges[0] or from_left > left - right:
        return -1
    row = sum(inclination <= edge for edge in edges) - 1  # it holds its upper border
    column = int(from_left * width / (left - right))
    return min(row, len(edges) - 2) * width + min(column, width - 1)


def back_projection(
    points: Points,
    pixel: NDArray[np.int64],
    winner: NDArray[np.int64],
    score: NDArray[np.float32],
    spec: Spec,
) -> NDArray[np.float32]:
    """Scores of pixels as scores of rows, float32 (N,); undefined for rows in no pixel."""
    of_rows, projection = score[pixel], spec["view"]["way_back"]
    distance = channel(points, "range")
    assert distance is not None
    shown = np.append(distance, np.float32(np.inf))[winner]
    for row in np.flatnonzero(pixel >= 0):
        if projection == "vote":
            of_rows[row] = vote(pixel[row], distance[row], shown, score, spec["view"]["grid"])
        elif projection == "nearest range" and distance[row] > shown[pixel[row]]:
            around = window(pixel[row], spec["view"]["grid"])
            differences = [abs(shown[one] - distance[row]) for _, one in around]
            of_rows[row] = score[around[int(np.argmin(differences))][1]]
    return of_rows


def window(pixel: int, grid: dict[str, Any]) -> list[tuple[int, int]]:
    """The pixels around one, itself first: number of the step that leads there, and the pixel."""
    height, width = len(grid["edges"]) - 1, grid["columns"]
    closed = grid["azimuth"][1] - grid["azimuth"][0] == 360.0
    around = []
    for number, (down, along) in enumerate(STEPS):
        row, column = pixel // width + down, pixel % width + along
        if 0 <= row < height and (closed or 0 <= column < width):
            around.append((number, int(row * width + column % width)))
    return around


def vote(
    pixel: int,
    distance: np.float32,
    shown: NDArray[np.float32],
    score: NDArray[np.float32],
    grid: dict[str, Any],
) -> np.float32:
    """Share of rain among the pixels most alike in range; the point's own always votes."""
    bell = [math.exp(-(down * down + along * along) / 2) for down, along in STEPS]
    weights = (1 - np.array(bell) / np.sum(bell)).astype(np.float32)
    ballots = []
    for number, one in window(pixel, grid):
        unlike = abs(shown[one] - distance) * weights[number] if number else np.float32(0)
        ballots.append((unlike, number, score[one] > 0.5))
    votes = [rain for unlike, _, rain in sorted(ballots)[:VOTERS] if unlike <= CUTOFF]
    return np.float32(sum(votes) / len(votes))


def main(model: str, scan: str, label: str) -> None:
    """Writes which points of a scan are rain: uint32, 1 for rain."""
    points = np.fromfile(scan, np.float32).reshape(-1, 4)
    Model(model).rain(points).astype(np.uint32).tofile(label)


if __name__ == "__main__":
    if len(sys.argv) != 4:
        raise SystemExit(f"usage: {sys.argv[0]} MODEL.onnx SCAN.bin OUT.label")
    main(*sys.argv[1:])
