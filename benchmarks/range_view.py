"""Times the range view and the ways back from it, in turns with plain NumPy, and compares answers.

    python benchmarks/range_view.py WADS/sample.bin
    python benchmarks/range_view.py WADS/sample.bin --grid wads

Plain NumPy takes the arctangents of all points in float64, and looks around for all that are hidden
in one go. Image, pixels, winners, ranges and scores must be the same, bit for bit. Memory is kept
from one scan for the next, as in `derain run`.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from turns import milliseconds_in_turns

from derain.files import read_scan
from derain.scan import Scan
from derain.system.memory import keep_freed_memory
from derain.views.back_projection import (
    BACK_PROJECTIONS,
    CUTOFF,
    REACH,
    VOTERS,
    WEIGHTS,
    WINDOW_STEPS,
)
from derain.views.channels import filled_values
from derain.views.directions import directions
from derain.views.grid_fit import fit_grid
from derain.views.range_image import RangeImage, RangeView
from derain.views.spherical_grid import SphericalGrid, grid_of

VOTERS_AT_A_TIME = 50_000


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scan", type=Path, help="a scan")
    parser.add_argument("--grid", help="name of a published grid; by default one fitted to it")
    parser.add_argument("--rounds", type=int, default=21, help="turns of each")
    arguments = parser.parse_args()

    keep_freed_memory()
    scan = read_scan(arguments.scan)
    grid = grid_of(arguments.grid, "--grid") if arguments.grid else fit_grid([scan]).grid
    view, pixels = RangeView(grid), f"{grid.rows}x{grid.columns}"
    image = view(scan)
    score = np.random.default_rng(0).random(image.size, np.float32)
    print(f"{arguments.scan.name}: {len(scan):,} points on {pixels}, {image.hidden.sum():,} hidden")
    print("| what | derain ms | plain ms | times faster |")
    print("|---|---:|---:|---:|")
    # A scan keeps the ranges that it was asked for once: each run has one of its own.
    row("view", arguments.rounds, lambda: view(replace(scan)), lambda: plain_view(view, scan))
    for back_projection, plain_back in PLAIN_BACK_PROJECTIONS.items():
        seen = replace(image, back_projection_name=back_projection)
        row(
            f"back: {back_projection}",
            arguments.rounds if back_projection != "vote" else 3,
            lambda seen=seen: seen.back(score),
            lambda plain_back=plain_back: plain_back_to_rows(plain_back, image, score),
        )


def row(title: str, rounds: int, ours: Callable[[], object], plain: Callable[[], object]) -> None:
    """Prints a row of the table."""
    assert_same(title, ours(), plain())
    times = milliseconds_in_turns({"ours": ours, "plain": plain}, rounds)
    mine, theirs = (float(np.median(times[name])) for name in ("ours", "plain"))
    ratio = np.median(np.divide(times["plain"], times["ours"]))
    print(f"| {title} | {mine:.1f} | {theirs:.1f} | {ratio:.1f} |")


def assert_same(title: str, ours: object, plain: object) -> None:
    """Ends the run where any bit differs."""
    if isinstance(ours, RangeImage):
        ours = {name: getattr(ours, name) for name in plain}
    else:
        ours, plain = {"score": ours}, {"score": plain}
    for name, expected in plain.items():
        found = ours[name]
        if found.dtype != expected.dtype or found.tobytes() != expected.tobytes():
            raise SystemExit(f"{title}: {name} differs")


def plain_view(view: RangeView, scan: Scan) -> dict[str, NDArray[np.generic]]:
    """Attributes of a range image, by name."""
    scan, grid = replace(scan), view.grid
    valid = np.flatnonzero(scan.valid)
    pixel = np.full(len(scan), -1)
    pixel[valid] = plain_pixel(grid, scan.xyz.take(valid, axis=0))
    rows = np.flatnonzero(pixel >= 0)
    nearest = np.full(grid.rows * grid.columns, np.inf, np.float32)
    np.minimum.at(nearest, pixel[rows], scan.range[rows])
    rows = rows[scan.range[rows] == nearest[pixel[rows]]]
    winner = np.full(len(nearest), -1)
    winner[pixel[rows[::-1]]] = rows[::-1]  # of equally near ones the lowest row is written last
    shown = np.flatnonzero(winner >= 0)
    image = np.zeros((len(view.channels), len(winner)), np.float32)
    image[:, shown] = filled_values(scan, winner[shown], view.channels, view.fill_value).T
    return {"image": image, "pixel": pixel, "winner": winner, "range": scan.range}


def plain_pixel(grid: SphericalGrid, xyz: NDArray[np.float32]) -> NDArray[np.int64]:
    """Pixel of each point, int64 (N,); -1 outside the grid."""
    azimuth, inclination = directions(xyz)
    ascending = np.array(grid.edges[::-1])
    row = np.minimum(grid.rows - np.searchsorted(ascending, inclination), grid.rows - 1)
    in_height = (inclination >= ascending[0]) & (inclination <= ascending[-1])
    right, left = grid.azimuth
    from_left = (left - azimuth) % 360
    column = (from_left * grid.columns / (left - right)).astype(np.int64)
    column = np.minimum(column, grid.columns - 1)
    inside = in_height & (from_left <= left - right)
    return np.where(inside, row * grid.columns + column, -1)


def plain_back_to_rows(
    plain_back: Callable[..., NDArray[np.float32]], image: RangeImage, score: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Scores of all rows, float32 (N,)."""
    nearest = np.full(image.size, np.inf, np.float32)
    shown = image.winner >= 0
    nearest[shown] = image.range[image.winner[shown]]
    nearest = nearest.reshape(image.valid.shape)
    judged = np.flatnonzero(image.judged)
    result = np.zeros(len(image.pixel), np.float32)
    result[judged] = plain_back(
        image.pixel[judged], image.range[judged], nearest, image.wraps, score
    )
    return result


def plain_copy(
    pixel: NDArray[np.int64],
    _distance: NDArray[np.float32],
    _nearest: NDArray[np.float32],
    _wraps: bool,
    score: NDArray[np.float32],
) -> NDArray[np.float32]:
    """The score of each point's own pixel."""
    return score.take(pixel)


def plain_nearest_range(
    pixel: NDArray[np.int64],
    distance: NDArray[np.float32],
    nearest: NDArray[np.float32],
    wraps: bool,
    score: NDArray[np.float32],
) -> NDArray[np.float32]:
    """The score of the pixel around each point that shows the range most like its own."""
    pixel = pixel.copy()
    hidden = np.flatnonzero(distance > nearest.ravel().take(pixel))
    of_position = padded(np.arange(nearest.size).reshape(nearest.shape), wraps, -1).ravel()
    shown = padded(nearest, wraps, np.inf).ravel()
    at, steps = positions(pixel[hidden], nearest.shape[1])
    best, least = at.copy(), np.full(len(hidden), np.inf, np.float32)
    for step in steps:
        difference = np.abs(shown.take(at + step) - distance[hidden])
        better = difference < least
        np.copyto(least, difference, where=better)
        np.copyto(best, at + step, where=better)
    pixel[hidden] = of_position.take(best)
    return score.take(pixel)


def plain_vote(
    pixel: NDArray[np.int64],
    distance: NDArray[np.float32],
    nearest: NDArray[np.float32],
    wraps: bool,
    score: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Share of rain among the votes of the pixels around each point."""
    shown = padded(nearest, wraps, np.inf).ravel()
    rain = padded(score.reshape(nearest.shape) > 0.5, wraps, False).ravel()
    result = np.empty(len(pixel), np.float32)
    for start in range(0, len(result), VOTERS_AT_A_TIME):
        part = slice(start, start + VOTERS_AT_A_TIME)
        at, steps = positions(pixel[part], nearest.shape[1])
        around = at[:, None] + steps
        difference = np.abs(shown.take(around) - distance[part, None]) * WEIGHTS
        difference[:, 0] = 0.0
        voters = np.argsort(difference, axis=1, kind="stable")[:, :VOTERS]
        votes = np.take_along_axis(difference, voters, axis=1) <= CUTOFF
        says_rain = rain.take(np.take_along_axis(around, voters, axis=1))
        result[part] = (votes & says_rain).sum(axis=1) / votes.sum(axis=1)
    return result


PLAIN_BACK_PROJECTIONS = dict(
    zip(BACK_PROJECTIONS, (plain_nearest_range, plain_copy, plain_vote), strict=True)
)


def positions(pixel: NDArray[np.int64], width: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Positions in a padded image, int64 (N,), and the steps of a window there, int64 (25,)."""
    padded_width = width + 2 * REACH
    row, column = np.divmod(pixel, width)
    steps = np.array([down * padded_width + right for down, right in WINDOW_STEPS])
    return (row + REACH) * padded_width + column + REACH, steps


def padded(image: NDArray[np.generic], wraps: bool, value: float) -> NDArray[np.generic]:
    """The image with a margin: on a full circle of its other end, elsewhere of one value."""
    sides, ends = ((0, 0), (REACH, REACH)), ((REACH, REACH), (0, 0))
    wide = np.pad(image, sides, "wrap") if wraps else np.pad(image, sides, constant_values=value)
    return np.pad(wide, ends, constant_values=value)


if __name__ == "__main__":
    main()
