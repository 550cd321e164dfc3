"""Checks that points are the view of one LiDAR from one place, in metres.

All methods assume this: neighbours are judged by distances in metres, and by the distance between
rays of one sensor at that range. Each check fails only at a share of points far beyond that of any
scan of a single sensor, so that there are no false warnings.
Units show in the ranges of points, and in the depth of the ground below the sensor: the feet of a
sensor that sees no ground, or is less than 1.3 m above it, pass for metres.
"""

from collections.abc import Iterator

import numpy as np

from derain.scan import Bools, Floats, Scan
from derain.views.morton import MOST_COPIES
from derain.views.scan_issues import ScanIssue

# Azimuth, inclination and range of points, float64 (3, M).
Rays = Floats

# A scan with fewer points, or a smaller share of valid rows, is too small to check.
FEWEST_RETURNS = 50
LEAST_VALID = 0.01

# Number of points, spread over all, for the checks of positions and units.
SAMPLED = 1024

# Points lie this many times farther off than from one another: the sensor is not at the origin. A
# sensor that sees no more than 11 degrees of a wall would come as near.
OFF_CENTRE = 10.0

# One point in twenty is farther off, metres: few LiDARs see anything there. The farthest of the
# scans looked at has one in a hundred beyond 160 m.
FAR_OFF = 500.0
FAR_PERCENTILE = 95

# All but one point in a hundred is nearer, metres: nothing but its own cover, if these are metres.
NEAR_BY = 1.0

# The ground is the lowest 5 % of the points at least 5 degrees below the horizon. In the scans that
# were looked at it is 0.4 to 2.7 m below the sensor. A road vehicle is at most 4 m high, with a
# sensor on its roof a little more. A sensor less than 0.3 m above the ground that sees no farther
# than a room is long is that of a toy, or of a vehicle in another unit.
# Source: Council Directive 96/53/EC, annex I, 1.3.
BELOW_HORIZON = -5.0
GROUND_PERCENTILE = 5
FEWEST_OF_GROUND = 20
HIGHEST_SENSOR = 4.2
LOWEST_SENSOR = 0.3
ROOM = 20.0

# Where rays keep to a plane, or to a cone about the axis: the root mean square of what they leave
# it by, as a sine, and degrees of inclination between all but 2 % of them.
OUT_OF_PLANE = 0.01
OPENING = 1.0

# The rays of one sensor are as dense near by as far off, so that returns crowd a cell of this many
# degrees, and of this ratio of ranges, alike at any range. Points of a map are as dense in space,
# and crowd the cells far off. No scan that was looked at is more than 1.12 times as crowded at some
# range as near by. Ten scans of a drive merged by their poses are 1.6 to 3.3 times, and four mostly
# 1.35 to 2.9 times. Two are 1.1 to 1.4 times: eight of ten such pairs, and most pairs of sensors on
# one vehicle, pass for one scan.
CELL = 0.1
ONE_SURFACE = 1.25
MORE_CROWDED = 1.25

# Where that is looked for: within this of the x and y axes and of the diagonals between them, as a
# tangent. It is a twentieth of the circle, and has to hold this many points.
BESIDE_AXIS = 0.02
FEWEST_IN_CELLS = 200

# Most neighbouring rays of a beam meet one surface: the median change of range from ray to ray,
# beyond the noise of a sensor that sees near walls, is at most 0.1 % in the scans that were looked
# at. Where scans of a moving sensor are put together without its poses, every surface but level
# ground is at several ranges, and the median is mostly 1.3 to 9 %. Rays within BEAM degrees of
# inclination are of one beam, points within RAY degrees of azimuth are of one ray, and rays up to
# NEXT_RAY degrees apart are neighbours.
BEAM = 0.05
RAY = 0.01
NEXT_RAY = 0.6
RANGE_NOISE, RANGE_STEP = 0.05, 0.008  # metres, and a share of the range

# Half of those eight arms. A sensor that looks one way sees fewer, and its rays may be as dense as
# it likes: those of a rosette crowd where it looks, and there it sees farthest.
FEWEST_ARMS = 4


def viewpoint_issues(scan: Scan) -> Iterator[ScanIssue]:
    """Returns the signs that a scan is not the view of one sensor from one place, in metres.

    A scan that is too far off or too small is not checked further.

    Args:
        scan: The scan.
    """
    rows = np.flatnonzero(scan.valid)
    if len(rows) < LEAST_VALID * len(scan) or len(rows) < FEWEST_RETURNS:
        if len(scan):
            yield _almost_empty_issue(scan)
        return
    sample = scan.xyz.take(rows[:: -(-len(rows) // SAMPLED)], axis=0).astype(np.float64)
    position, times = _commonest(sample)
    if times > MOST_COPIES:
        yield _no_returns_issue(scan, position)
        others = sample[(sample != position).any(axis=1)]
        sample = others if len(others) else sample
    issue = _off_centre_issue(sample) or _unit_issue(sample)
    issue = issue or _single_beam_issue(sample) or _viewpoints_issue(scan)
    if issue is not None:
        yield issue


def _almost_empty_issue(scan: Scan) -> ScanIssue:
    """The issue of a scan with few points that can be judged."""
    return ScanIssue(
        "almost empty",
        f"{np.count_nonzero(scan.valid):,} of {len(scan):,} rows are points that can be judged: "
        "too few to check the scan. The sensor may be covered or the file cut short; from "
        "coordinates of a map (UTM), subtract the sensor's position",
    )


def _commonest(sample: Floats) -> tuple[Floats, int]:
    """The position, float64 (3,), that most of the points, float64 (M, 3), share; their number."""
    positions, times = np.unique(sample, axis=0, return_counts=True)
    return positions[times.argmax()], int(times.max())


def _no_returns_issue(scan: Scan, position: Floats) -> ScanIssue:
    """The issue of a scan with many points at one position, float64 (3,)."""
    number = np.count_nonzero((scan.xyz == position).all(axis=1))
    x, y, z = position
    return ScanIssue(
        "many points at one position",
        f"{number:,} points lie at ({x:g}, {y:g}, {z:g}) m, as rays without a return do in a frame "
        "that is not the sensor's: leave them out, or judge scans before they are moved (only "
        "networks of range images judge such points)",
    )


def _off_centre_issue(sample: Floats) -> ScanIssue | None:
    """The issue of points, float64 (M, 3), that lie together, far from the origin."""
    centre = np.median(sample, axis=0)
    around = float(np.median(np.linalg.norm(sample - centre, axis=1)))
    away = float(np.linalg.norm(centre))
    if not away > OFF_CENTRE * around > 0:
        return None
    return ScanIssue(
        "coordinates of a map",
        f"the points lie about {away:,.0f} m from the origin, and half of them within "
        f"{around:,.0f} m of one another: subtract the sensor's position, as from coordinates "
        "of a map (UTM), because the sensor has to be the origin",
    )


def _unit_issue(sample: Floats) -> ScanIssue | None:
    """The issue of points, float64 (M, 3), that are farther off or nearer than in metres."""
    range_ = np.linalg.norm(sample, axis=1)
    far, near = np.percentile(range_, [FAR_PERCENTILE, 99])
    height = _height(sample)
    all_near = f"all but one point in a hundred are within {near:.2g} m"
    ground = f"the ground is {height:.2g} m below the sensor"
    if far > FAR_OFF:
        sign = f"one point in twenty is more than {far:,.0f} m away"
    elif near < NEAR_BY:
        sign = all_near
    elif height < LOWEST_SENSOR and near < ROOM:
        sign = f"{ground}, and {all_near}"
    elif height > HIGHEST_SENSOR:
        sign = f"{ground}, farther than below any vehicle's"
    else:
        return None
    return ScanIssue(
        "coordinates not in metres",
        f"{sign}: coordinates have to be in metres, as seen from the sensor (divide millimetres "
        "by 1,000, multiply feet by 0.3048)",
    )


def _height(sample: Floats) -> float:
    """Depth of the ground below the sensor, metres; points are float64 (M, 3). NaN if unseen."""
    x, y, z = sample.T
    below = z[z < np.tan(np.radians(BELOW_HORIZON)) * np.hypot(x, y)]
    if len(below) < FEWEST_OF_GROUND:
        return np.nan
    return -float(np.percentile(below, GROUND_PERCENTILE))


def _single_beam_issue(sample: Floats) -> ScanIssue | None:
    """The issue of points, float64 (M, 3), that are all of one plane or cone of rays."""
    rays = sample / np.linalg.norm(sample, axis=1, keepdims=True)
    lowest, highest = np.degrees(np.arcsin(np.percentile(rays[:, 2], [1, 99]).clip(-1, 1)))
    # Not a product of matrices, whose threads would take longer to wake than it takes.
    moments = np.einsum("ij,ik->jk", rays, rays) / len(rays)
    least = float(np.linalg.eigvalsh(moments)[0])
    if least >= OUT_OF_PLANE**2 and highest - lowest >= OPENING:
        return None
    return ScanIssue(
        "a single beam",
        "all points are of one beam, as those of a planar scanner: models and filters are made "
        "for sensors of many beams, and may remove solid points",
    )


def _viewpoints_issue(scan: Scan) -> ScanIssue | None:
    """The issue of points that are denser, or surfaces more often torn, than in one scan."""
    rays = rays_near_axes(scan)
    crowding, step = crowding_far_off(rays), range_step(rays)
    if crowding > MORE_CROWDED:
        reason = f"points far off are {crowding:.1f} times as dense, in angle, as those near by"
    elif step > RANGE_STEP:
        reason = f"the range changes by {step:.1%} (median) between neighbouring rays of a beam"
    else:
        return None
    return ScanIssue(
        "points of several viewpoints",
        f"{reason}, which no sensor sees from one place: clean scans one by one, in the sensor's "
        "coordinates, before they are merged into a map",
    )


def rays_near_axes(scan: Scan) -> Rays:
    """Azimuth and inclination in degrees, and range in metres, of points near eight directions.

    Args:
        scan: The scan.

    Returns:
        float64 (3, M): those of the points near the x and y axes and the diagonals between them.
    """
    x, y, z = scan.xyz[_near_axes(scan) & scan.valid].T.astype(np.float64)
    horizontal = np.hypot(x, y)
    azimuth, inclination = np.degrees([np.arctan2(y, x), np.arctan2(z, horizontal)])
    return np.stack([azimuth, inclination, np.hypot(horizontal, z)])


def crowding_far_off(rays: Rays) -> float:
    """Density of points in angle at some range, relative to that of the nearest ones.

    Args:
        rays: Azimuth, inclination and range of points, as :func:`rays_near_axes` gives them; those
            at one position count once.

    Returns:
        The greatest mean number of points to a cell among quarters of the points by range, over
        that of the nearest quarter; 1 where there are few points, or all are on one side of the
        sensor.
    """
    azimuth, inclination, range_ = rays
    if len(range_) < FEWEST_IN_CELLS or len(np.unique(np.round(azimuth / 45) % 8)) < FEWEST_ARMS:
        return 1.0
    cells = np.round(azimuth / CELL) * 360 / CELL + np.round(inclination / CELL)
    surface = np.floor(np.log(range_) / np.log(ONE_SURFACE))
    order = np.argsort(range_)
    first = order[np.append(True, np.diff(range_[order]) > 0)]
    occupied = (cells * 1000 + surface)[first]
    _, cell, points = np.unique(occupied, return_inverse=True, return_counts=True)
    quarters = [part.mean() for part in np.array_split(points[cell], 4)]
    return float(max(quarters) / quarters[0])


def range_step(rays: Rays) -> float:
    """Median change of range from one ray of a beam to the next, as a share of the nearer range.

    RANGE_NOISE is taken off each change.

    Args:
        rays: Azimuth, inclination and range of points, as :func:`rays_near_axes` gives them; of
            several returns of a ray, the farthest counts.

    Returns:
        0 where there are few neighbouring rays.
    """
    azimuth, inclination, range_ = rays
    beam, ray = np.round(inclination / BEAM), np.round(azimuth / RAY)
    order = np.lexsort((range_, ray, beam))
    beam, ray, range_ = beam[order], ray[order], range_[order]
    farthest = (np.diff(beam, append=np.inf) > 0) | (np.diff(ray, append=np.inf) != 0)
    beam, ray, range_ = beam[farthest], ray[farthest], range_[farthest]
    apart = np.diff(ray)  # 1 may be one ray on either side of a boundary
    neighbours = (np.diff(beam) == 0) & (apart > 1) & (apart < NEXT_RAY / RAY)
    if neighbours.sum() < FEWEST_IN_CELLS:
        return 0.0
    change = np.maximum(np.abs(np.diff(range_)) - RANGE_NOISE, 0)
    nearer = np.minimum(range_[:-1], range_[1:])
    return float(np.median((change / nearer)[neighbours]))


def _near_axes(scan: Scan) -> Bools:
    """True for points that are near the x and y axes and the diagonals between them, bool (N,)."""
    near = np.zeros(len(scan), bool)
    x, y = np.ascontiguousarray(scan.xyz[:, :2].T)
    with np.errstate(invalid="ignore"):
        for u, v in ((x, y), (x + y, x - y)):
            u, v = np.abs(u), np.abs(v)
            near |= (v < BESIDE_AXIS * u) | (u < BESIDE_AXIS * v)
    return near
