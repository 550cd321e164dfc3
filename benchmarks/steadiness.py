"""Scores methods on one scan of snow after common changes of scans, and on doubled clean scans.

    python -m benchmarks.steadiness --shared ../shared --methods default old.onnx crf

IoU of the changed WADS sample, in which labels go with their points; and the share that is taken of
a clean scan of KITTI whose every point has a copy behind it on its ray.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.labelled import read_labelled
from derain.cards.card import load_card
from derain.datamodules.user_changes import across, along
from derain.evaluation.text_tables import markdown_table
from derain.export.methods import load_method
from derain.files import read_scan
from derain.scan import Bools, Float32s, Scan

SNOW = Path("data/wads/sample.bin")
CLEAN = Path("data/clean/kitti_hdl64.bin")

FOOT = 0.3048
COPIES_BEHIND = (0.001, 0.002, 0.004, 0.02)  # metres
JITTERS = (1e-6, 1e-3, 2e-2)  # metres


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shared", type=Path, required=True, help="folder of the real scans")
    parser.add_argument("--methods", nargs="+", required=True, help="models and filters")
    arguments = parser.parse_args()
    methods = {name: load_method(name, {}) for name in arguments.methods}
    card, rows = load_card("wads"), []
    for name, scan in changed(read_labelled(arguments.shared / SNOW)):
        rain = card.rain_of(scan)
        ious = [iou(method.push(scan).rain, rain) for method in methods.values()]
        rows.append([name, *(f"{value:.3f}" for value in ious)])
    for name, scan in doubled(read_scan(arguments.shared / CLEAN)):
        taken = [100 * method.push(scan).rain.mean() for method in methods.values()]
        rows.append([name, *(f"{value:.3f} %" for value in taken)])
    print(markdown_table(["scan", *methods], rows))


def iou(called: Bools, rain: Bools) -> float:
    """Intersection over union of the called rain, bool (N,), and the true rain."""
    return float((called & rain).sum() / max((called | rain).sum(), 1))


def changed(scan: Scan) -> Iterator[tuple[str, Scan]]:
    """The scan after each change that users make, by the name of the change.

    Args:
        scan: A labelled scan.
    """
    generator = np.random.default_rng(0)
    xyz = scan.xyz
    yield "unchanged", scan
    for degrees in (0.5, 1.3, 45, 90, 200):
        yield f"turned by {degrees:g}°", replace(scan, xyz=_turned(xyz, np.radians(degrees)))
    yield "mirrored", replace(scan, xyz=xyz * np.float32([1, -1, 1]))
    yield "rows shuffled", scan.take(generator.permutation(len(scan)))
    yield "every second row missing", scan.take(np.arange(0, len(scan), 2))
    yield "three of four rows missing", scan.take(np.arange(0, len(scan), 4))
    for spread in (0.02, 0.05):
        shaken = across(xyz, spread, generator)
        yield f"noise of {100 * spread:g} cm across the ray", replace(scan, xyz=shaken)
    shaken = along(xyz, generator.normal(0, 0.02, len(scan)))
    yield "noise of 2 cm along the ray", replace(scan, xyz=shaken)
    yield "3 m aside of the sensor", replace(scan, xyz=xyz + np.float32([3, 0, 0]))
    yield "1 m above the sensor", replace(scan, xyz=xyz + np.float32([0, 0, 1]))
    yield "y > 0 alone", scan.take(xyz[:, 1] > 0)
    yield "in feet", replace(scan, xyz=(xyz / np.float32(FOOT)).astype(np.float32))
    for jitter in JITTERS:
        copy = replace(scan, xyz=along(xyz, generator.normal(0, jitter, len(scan))))
        rows = np.arange(2 * len(scan)) % len(scan)
        twice = replace(scan.take(rows), xyz=np.concatenate([xyz, copy.xyz]))
        yield f"doubled, ranges {1e3 * jitter:g} mm apart", twice
    drawn = generator.integers(0, 256, len(scan)).astype(np.float32)
    yield "intensities drawn at random", replace(scan, intensity=drawn)
    rows = (np.arange(len(scan)) % 64).astype(np.float32)
    yield "rows counted to 64 as intensities", replace(scan, intensity=rows)
    inclination = np.arctan2(xyz[:, 2], np.hypot(xyz[:, 0], xyz[:, 1]))
    rings = np.floor(64 * inclination.argsort().argsort() / len(scan)).astype(np.float32)
    yield "numbers of rings as intensities", replace(scan, intensity=rings)


def doubled(scan: Scan) -> Iterator[tuple[str, Scan]]:
    """A clean scan whose every point has a copy behind it."""
    yield "clean KITTI, unchanged", scan
    rows = np.arange(2 * len(scan)) % len(scan)
    for behind in COPIES_BEHIND:
        xyz = np.concatenate([scan.xyz, along(scan.xyz, np.full(len(scan), behind))])
        yield f"clean KITTI, doubled at {1e3 * behind:g} mm", replace(scan.take(rows), xyz=xyz)


def _turned(xyz: Float32s, angle: float) -> Float32s:
    sine, cosine = np.sin(angle), np.cos(angle)
    turn = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
    return (xyz @ turn).astype(np.float32)


if __name__ == "__main__":
    main()
