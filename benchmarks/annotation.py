"""Compares labels by geometry with the truth of the simulator: scores and errors.

    python -m benchmarks.annotation
    python -m benchmarks.annotation --tracks 5 --scans 3

Each track is a simulated facility in which it rains at four rates, described once as the paper
does, with drops over the road alone, and once with the ground beside it that the sprinklers wet.
"""

import argparse
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from tqdm import tqdm

from benchmarks.track_scene import scene_of_track
from derain.annotation.scene import Scene, inside
from derain.annotation.steps import Plane, annotate, road_plane
from derain.evaluation.counts import intersection_over_union
from derain.evaluation.text_tables import markdown_table
from derain.fusion import UNKNOWN
from derain.scan import Floats, Ints, Scan
from derain.simulation.classes import TrackClass
from derain.simulation.facility import lay_out_facility
from derain.simulation.rain import rain_on_beams
from derain.simulation.rain_field import SprinkledRain, UniformRain
from derain.simulation.sensor import load_sensor

RATES = (0.0, 10.0, 25.0, 50.0)
KINDS = len(TrackClass)
HEIGHTS = (0.02, 0.05, 0.1, 0.2, 0.3)
SHIFTS = (0.05, 0.1, 0.2)
SENSOR = "mems_256"

# How far beside the road the sprinklers' water comes down, metres.
BESIDE = 10.0


def sequences(tracks: int, scans: int) -> Iterator[tuple[float, list[Scan], dict[str, Scene]]]:
    """Rain rate, labelled scans and scenes of every sequence."""
    sensor = load_sensor(SENSOR)
    with tqdm(total=tracks * len(RATES), unit="sequence", disable=None) as progress:
        for seed in range(tracks):
            generator = np.random.default_rng(seed)
            track = lay_out_facility(generator)
            clear = track.cast(sensor)
            scenes = {
                "road alone, as in the paper": scene_of_track(track, sensor),
                f"road and {BESIDE:g} m beside it": scene_of_track(track, sensor, BESIDE),
            }
            for rate in RATES:
                rain = SprinkledRain(rate) if rate else UniformRain(0)
                drawn = (
                    rain_on_beams(clear, sensor.beams(), rain, sensor, generator)
                    for _ in range(scans)
                )
                yield rate, [sensor.measure(returns, generator) for returns in drawn], scenes
                progress.update()


@dataclass
class Findings:
    """Counts of labelling: points by class (rows) and label (columns), and reasons of errors."""

    table: Ints = field(default_factory=lambda: np.zeros((KINDS, KINDS), np.int64))
    reasons: Counter[str] = field(default_factory=Counter)

    def add(self, scan: Scan, scene: Scene, plane: Plane) -> None:
        """Labels a scan. Unknown labels do not count."""
        assert scan.label is not None
        label = annotate(scan, scene, plane)
        counted = label != UNKNOWN
        pairs = scan.label[counted] * KINDS + label[counted]
        self.table += np.bincount(pairs, minlength=KINDS**2).reshape(KINDS, KINDS)
        self.reasons.update(_reasons(scan.take(counted), label[counted], scene, plane))

    @property
    def agreement(self) -> float:
        """Share of the points with the right label."""
        return float(self.table.trace() / self.table.sum())

    @property
    def iou(self) -> Floats:
        """Intersection over union of each class; NaN for one that does not occur."""
        hits = self.table.diagonal()
        errors = self.table.sum(axis=0) + self.table.sum(axis=1) - 2 * hits
        return intersection_over_union(hits, errors)


def _reasons(scan: Scan, label: Ints, scene: Scene, plane: Plane) -> dict[str, int]:
    """Reasons of wrong labels: for each point the first reason that holds."""
    assert scan.label is not None
    points = scan.xyz.astype(np.float64)
    drop, over = scan.label == TrackClass.RAIN, inside(scene.rain_area or scene.road, points)
    flat = [TrackClass.ROAD, TrackClass.BACKGROUND]
    reasons = {
        "drop, beside the ground that is looked at": drop & ~over,
        "drop, no higher than the threshold": drop & (plane.height(points) <= scene.height),
        "drop, in a box": drop,
        "solid thing, called rain": label == TrackClass.RAIN,
        "edge of the road": np.isin(scan.label, flat) & np.isin(label, flat),
        "edge or foot of a box": np.ones(len(scan), bool),
    }
    wrong = np.flatnonzero(label != scan.label)
    first = np.argmax(np.stack([holds[wrong] for holds in reasons.values()]), axis=0)
    return dict(zip(reasons, np.bincount(first, minlength=len(reasons)).tolist(), strict=True))


def _variants(scene: Scene) -> dict[str, Scene]:
    """The scene with other thresholds, and with every box moved at random, as by a hasty hand."""
    generator = np.random.default_rng(0)
    others = {f"threshold {height:g} m": replace(scene, height=height) for height in HEIGHTS}
    for shift in SHIFTS:
        corrections = {
            name: {"shift": tuple(generator.normal(0, shift, 3))} for name in scene.boxes
        }
        moved = replace(scene, corrections={"moved": corrections}).in_sequence("moved")
        others[f"boxes moved by {shift:g} m (standard deviation along each axis)"] = moved
    return others


def _print_tables(
    by_rate: dict[tuple[str, float], Findings],
    by_scene: dict[str, Findings],
    by_variant: dict[str, Findings],
) -> None:
    names = [kind.name.lower() for kind in TrackClass]
    body = []
    for (name, rate), found in by_rate.items():
        points, iou = f"{found.table.sum():,}", f"{found.iou[TrackClass.RAIN]:.4f}"
        body.append([name, f"{rate:g}", points, f"{found.agreement:.3%}", iou if rate else "-"])
    head = ["drops are sought over", "rain mm/h", "points", "agreement", "rain IoU"]
    print(markdown_table(head, body))

    body = [[name, *(f"{iou:.4f}" for iou in found.iou)] for name, found in by_scene.items()]
    print("\n" + markdown_table(["IoU by class", *names], body))

    name, found = list(by_scene.items())[-1]
    counts = found.table.tolist()
    body = [[kind, *map("{:,}".format, row)] for kind, row in zip(names, counts, strict=True)]
    print("\n" + markdown_table([f"{name}: truth \\ label", *names], body))

    body = []
    for reason in found.reasons:
        shares = (each.reasons[reason] / each.table.sum() for each in by_scene.values())
        body.append([reason, *(f"{share:.4%}" for share in shares)])
    print("\n" + markdown_table(["wrong labels, share of all points", *by_scene], body))

    body = [
        [variant, f"{found.agreement:.3%}", f"{found.iou[TrackClass.RAIN]:.4f}"]
        for variant, found in by_variant.items()
    ]
    print("\n" + markdown_table([name, "agreement", "rain IoU"], body))


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tracks", type=int, default=3, help="tracks, each at four rain rates")
    parser.add_argument("--scans", type=int, default=2, help="scans of each")
    arguments = parser.parse_args()

    by_rate: dict[tuple[str, float], Findings] = defaultdict(Findings)
    by_scene: dict[str, Findings] = defaultdict(Findings)
    by_variant: dict[str, Findings] = defaultdict(Findings)
    for rate, scans, scenes in sequences(arguments.tracks, arguments.scans):
        for name, scene in scenes.items():
            plane = road_plane(scans, scene)
            for scan in scans:
                by_rate[name, rate].add(scan, scene, plane)
                by_scene[name].add(scan, scene, plane)
        for name, variant in _variants(scene).items():
            for scan in scans:
                by_variant[name].add(scan, variant, plane)
    _print_tables(dict(sorted(by_rate.items())), by_scene, by_variant)


if __name__ == "__main__":
    main()
