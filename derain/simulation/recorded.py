"""Rain on scans that were recorded in clear air."""

from dataclasses import replace

import numpy as np
from numpy.random import Generator

from derain.files.columns import intensity_name
from derain.scan import Array, Bools, Floats, Ints, Scan, to_float32
from derain.simulation.classes import TrackClass
from derain.simulation.rain import rain_on_beams
from derain.simulation.rain_field import RainField
from derain.simulation.recorded_beams import find_beams
from derain.simulation.sensor import FULL_SCALE_INTENSITY, Returns, Sensor
from derain.views.full_scale import full_scale

# The reflectivity that every surface is taken to have in a scan without intensities: a tenth, for
# which makers of LiDARs state the range.
USUAL_REFLECTIVITY = 0.1


def rain_on_scan(scan: Scan, rain: RainField, sensor: Sensor, generator: Generator) -> Scan:
    """Simulates rain on a scan that was recorded in clear air.

    A return keeps its place and gets darker, or a drop in front of it takes its place, or it is
    lost. A beam that returned nothing may hit a drop; :func:`find_beams` finds such beams. Returns
    nearer than the sensor's minimum range are the vehicle's own and do not change, nor do points of
    a radar. Two returns of one beam in two rows are treated as returns of two beams, so such a beam
    meets twice as many drops. Columns of a second return in the same row do not change.

    Reflectivity is the intensity as a share of its full scale (1, 255 or 65,535), or a tenth where
    the scan has none. Where all intensities are equal they were not measured: every return keeps
    that value, and drops get it as well, because any other would give them away.

    By its intensity a return may be too dark for ``sensor``, although it was recorded. How far
    above the threshold it really was is not known, and therefore drawn: above twice the threshold
    with probability 1/2, above ten times with 1/10, and so on. So drawn, the probability that such
    a return is lost is the share of its light that the rain takes away.

    Args:
        scan: The scan. Its file's columns of coordinates, intensity, and range or distance follow
            what happens; all others are kept.
        rain: The rain.
        sensor: Its beam width and its detection of drops count; where its beams point does not. It
            reports the last return, or else the strongest.
        generator: Random generator.

    Returns:
        The scan in the rain, with labels: TrackClass.RAIN for drops, and for all other rows the
        label that the scan had, 0 if it had none or the return is lost. Rows come in the order of
        ``scan``. The row of a lost return is left out; in an organised scan it stays and looks like
        the scan's other empty cells, or is NaN if there are none. A drop on a beam that had
        returned nothing fills the beam's cell; in a scan without cells it becomes a row at the end,
        whose other columns are those of the return before it in its row of the sensor's grid.
    """
    beams = find_beams(scan, generator)
    too_near = beams.returned & (scan.range[beams.row] < sensor.minimum_range)
    exposed = np.flatnonzero(np.isfinite(beams.direction[:, 0]) & ~too_near)  # to the rain
    row, direction = beams.row[exposed], beams.direction[exposed]
    returns = scan.take(beams.row[beams.returned])
    measured = scan if returns.measured_intensity is not None else replace(scan, intensity=None)
    clear = _clear_air(measured, row, beams.returned[exposed], sensor, generator)
    one_return = replace(sensor, returns="last" if sensor.returns == "last" else "strongest")
    detected = rain_on_beams(clear, direction, rain, one_return, generator)

    wet = detected.label == TrackClass.RAIN
    kept = detected.returned & ~wet
    rained = scan.take(beams.row)
    label = np.zeros(len(rained), np.int64) if rained.label is None else rained.label.copy()
    label[exposed] = np.where(kept, label[exposed], detected.label)
    distance = sensor.measured_range(detected.range[wet], generator)
    drops = direction[wet] * distance[:, None]
    rained = with_points(rained.with_label(label), exposed[wet], drops)
    if scan.intensity is not None:
        if measured.intensity is not None:
            intensity = scan.intensity[row].astype(np.float64)
            # The recorded value is dimmed as much as the light. It is not computed from the
            # reflectivity, which may have been drawn at random.
            intensity[kept] *= detected.reflectivity[kept] / clear.reflectivity[kept]
            of_drops = sensor.measured_intensity(detected.reflectivity[wet], generator)
            intensity[wet] = full_scale([scan]) * (of_drops / FULL_SCALE_INTENSITY)
        else:
            anywhere = beams.row[beams.returned][:1]
            intensity = np.resize(scan.intensity[anywhere].astype(np.float64), len(row))
        rained = with_intensity(rained, exposed[detected.returned], intensity[detected.returned])
    if scan.shape is None:
        return rained.take(np.delete(np.arange(len(rained)), exposed[~detected.returned]))
    lost = exposed[clear.returned & ~detected.returned]
    return replace(_emptied(rained, lost, scan), shape=scan.shape)


def _clear_air(
    scan: Scan, row: Ints, returned: Bools, sensor: Sensor, generator: Generator
) -> Returns:
    """Returns of beams through clear air that are strong enough to be detected."""
    range_ = np.where(returned, scan.range[row].astype(np.float64), sensor.maximum_range)
    if scan.intensity is None:
        reflectivity = np.full(len(row), USUAL_REFLECTIVITY)
    else:
        reflectivity = np.clip(scan.intensity[row] / full_scale([scan]), 0, 1).astype(np.float64)
    needed = sensor.detection_threshold * range_**2
    # The random numbers are at least 0 and less than 1, so there is no division by 0.
    excess = 1 / (1 - generator.random(len(row)))
    reflectivity = np.where(reflectivity < needed, needed * excess, reflectivity)
    reflectivity = np.where(returned, reflectivity, 0)
    label = np.full(len(row), TrackClass.BACKGROUND, np.int64)
    return Returns(range_, reflectivity, label, np.arange(len(row)))


def _emptied(rained: Scan, rows: Ints, scan: Scan) -> Scan:
    """Makes rows of an organised scan look like the empty cells that it had in clear air."""
    pattern = np.flatnonzero(~scan.valid)[:1]
    xyz = scan.xyz[pattern].astype(np.float64) if len(pattern) else np.full((1, 3), np.nan)
    rained = with_points(rained, rows, np.repeat(xyz, len(rows), axis=0))
    if scan.intensity is None:
        return rained
    intensity = scan.intensity[pattern].astype(np.float64) if len(pattern) else np.zeros(1)
    return with_intensity(rained, rows, np.repeat(intensity, len(rows)))


# What files call the distance of a point, in a unit of their own.
RANGE_NAMES = ("range", "distance")


def with_points(scan: Scan, rows: Ints, xyz: Floats) -> Scan:
    """The scan with other coordinates in some rows.

    Columns of coordinates, and of range or distance in any unit, get the new values in their own
    dtype; every other row stays the same, to the bit.

    Args:
        scan: The scan.
        rows: Row numbers, int64 (M,).
        xyz: Their coordinates, float64 (M, 3), metres in the sensor frame; NaN becomes 0 in columns
            of whole numbers.
    """
    named = {"xyz": xyz, "x": xyz[:, 0], "y": xyz[:, 1], "z": xyz[:, 2]}
    distance = np.linalg.norm(xyz, axis=1)
    fields = dict(scan.fields)
    for name, column in fields.items():
        if name.lower() in named:
            fields[name] = _written(column, rows, named[name.lower()])
        elif name.lower() in RANGE_NAMES:
            fields[name] = _written(column, rows, distance * _unit(column, scan))
    return replace(scan, xyz=_written(scan.xyz, rows, to_float32(xyz)), fields=fields)


def with_intensity(scan: Scan, rows: Ints, intensity: Floats) -> Scan:
    """The scan with other intensities in some rows; every other row stays the same, to the bit.

    Args:
        scan: A scan with intensities.
        rows: Row numbers, int64 (M,).
        intensity: Their intensities in the scan's unit, float64 (M,), rounded in a column of whole
            numbers.
    """
    assert scan.intensity is not None
    fields = dict(scan.fields)
    name = intensity_name(scan.name, fields)
    if name is not None:
        fields[name] = _written(fields[name], rows, intensity)
        # The scan's intensity is what its file holds: rounded in a column of whole numbers.
        intensity = fields[name][rows]
    seen = _written(scan.intensity, rows, to_float32(intensity))
    return replace(scan, intensity=seen, fields=fields)


def _unit(column: Array, scan: Scan) -> float:
    """The number in a column of ranges that stands for one metre."""
    valid = scan.valid
    return float(np.median(column[valid] / scan.range[valid])) if valid.any() else 1.0


def _written(column: Array, rows: Ints, values: Array) -> Array:
    column = column.copy()
    if column.dtype.kind in "iu":
        limits = np.iinfo(column.dtype)
        values = np.clip(np.rint(np.nan_to_num(values)), limits.min, limits.max)
    column[rows] = values
    return column
