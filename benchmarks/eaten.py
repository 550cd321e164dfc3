"""Measures the share that methods remove: of rain, of each kind of object, and of clean scans.

    python benchmarks/eaten.py dror crf persistence model.onnx tuned.yaml --card wads \
        --data WADS/drive/velodyne --clean clean/*

A method is named as in `derain run`, and settings may follow: crf:variant=published. Clean scans
are judged one by one, also by methods that use several. Their intensities are converted to the unit
of the method, as by `derain run --intensity-scale`. Labels only measure.
"""

import argparse
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import yaml

from derain.cards.card import DataCard, load_card
from derain.datamodules.base import Loading
from derain.datamodules.labelled import labelled_scans
from derain.evaluation.contents import class_name
from derain.evaluation.counts import Counts, ratio
from derain.evaluation.text_tables import markdown_table, number_text
from derain.export.methods import load_method, named_method
from derain.export.runtime import Derainer
from derain.filters import FilterDerainer
from derain.scan import Bools, Scan
from derain.sources.folders import named_frames
from derain.sources.frame import Frame
from derain.sources.judging import judgements
from derain.sources.method import Method
from derain.views.full_scale import full_scale
from derain.views.morton import distinct_rows
from derain.views.scan_issues import SCALE_OF_UNIT


@dataclass
class Eaten:
    """The points that one method removed from labelled scans.

    Attributes:
        counts: Points by whether they are rain and were called so.
        of_class: Points by class.
        taken: Those called rain, by class.
    """

    counts: Counts = field(default_factory=Counts)
    of_class: Counter[int] = field(default_factory=Counter)
    taken: Counter[int] = field(default_factory=Counter)

    def add(self, called: Bools, scan: Scan, card: DataCard) -> None:
        """Counts a labelled scan, whose points that nobody knows are left out."""
        rows = distinct_rows(scan)[0] if card.deduplicate else np.flatnonzero(scan.valid)
        rows = rows[~card.unknown_of(scan)[rows]]
        assert scan.label is not None
        label, called = scan.label[rows], called[rows]
        self.counts += Counts.of(called, card.rain_of(scan)[rows])
        self.of_class.update(label.tolist())
        self.taken.update(label[called].tolist())


def main() -> None:
    """Prints a table of labelled scans and one of clean scans, as far as there are such."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("methods", nargs="+", help="filters, methods, models or tuned YAML files")
    parser.add_argument("--data", nargs="+", type=Path, default=[], help="labelled recordings")
    parser.add_argument("--card", default="wads", help="their data card (default: %(default)s)")
    parser.add_argument("--clean", nargs="+", type=Path, default=[], help="scans without rain")
    parser.add_argument("--threads", type=int, default=0)
    arguments = parser.parse_args()
    methods = {text: _loaded(text, arguments.threads) for text in arguments.methods}
    if arguments.data:
        card = load_card(arguments.card)
        data = labelled_scans(arguments.data, card, Loading())
        frames = list(data.source("test"))
        eaten = {name: _eaten(method, frames, card) for name, method in methods.items()}
        print(_table_of_classes(eaten, f"{card.title}, {len(frames)} scans", card), end="\n\n")
    if arguments.clean:
        print(_table_of_clean(methods, list(named_frames(arguments.clean))))


def _loaded(text: str, threads: int) -> Method:
    """A method by its name, and settings after a colon if there are any."""
    name, _, settings = text.partition(":")
    method, parameters = named_method(name)
    pairs = (setting.partition("=") for setting in settings.split(",") if setting)
    given = {key: yaml.safe_load(value) for key, _, value in pairs}
    return load_method(method, {**parameters, **given}, threads)


def _eaten(method: Method, frames: Sequence[Frame], card: DataCard) -> Eaten:
    eaten = Eaten()
    for frame, judgement, _ in judgements(method, frames):
        scan = judgement.scan
        eaten.add(judgement.rain, scan.with_label(frame.read_label(len(scan))), card)
    return eaten


def _table_of_classes(eaten: Mapping[str, Eaten], title: str, card: DataCard) -> str:
    """Scores, and the share of each class that was taken, the most frequent class first."""
    counts = [each.counts for each in eaten.values()]
    of_class = next(iter(eaten.values())).of_class
    rain = sum(points for id_, points in of_class.items() if id_ in card.rain)
    dry = of_class.total() - rain
    body = [
        ["precision", "", *(number_text(each.precision) for each in counts)],
        ["recall: rain eaten", f"{rain:,}", *(number_text(each.recall) for each in counts)],
        ["IoU", "", *(number_text(each.iou) for each in counts)],
        ["objects eaten", f"{dry:,}", *(_percent(each.false_positive, dry) for each in counts)],
    ]
    for id_, points in of_class.most_common():
        if id_ not in card.rain:
            shares = (_percent(each.taken[id_], points) for each in eaten.values())
            body.append([class_name(id_, card.classes), f"{points:,}", *shares])
    return markdown_table([title, "points", *eaten], body)


def _table_of_clean(methods: Mapping[str, Method], frames: Sequence[Frame]) -> str:
    """The share of each clean scan that every method takes."""
    body = []
    for frame in frames:
        points = int(frame.read().valid.sum())
        taken = (_taken(method, frame) for method in methods.values())
        body.append([Path(frame.name).name, f"{points:,}", *(_percent(n, points) for n in taken)])
    return markdown_table(["clean scan", "points", *methods], body)


def _taken(method: Method, frame: Frame) -> int:
    """Number of points of a scan, alone in its recording, that are called rain."""
    in_unit = frame.with_intensity_times(_factor(method, frame.read()))
    return sum(int(judgement.rain.sum()) for _, judgement, _ in judgements(method, [in_unit]))


def _factor(method: Method, scan: Scan) -> float:
    """The factor from a scan's intensities to the unit of a method; 1 if it has none."""
    own = full_scale([scan])
    wanted = _unit_of(method)
    return wanted / own if wanted is not None and np.isfinite(own) else 1.0


def _unit_of(method: Method) -> float | None:
    """Full scale of the intensities that a method is for; None where it is for any."""
    if isinstance(method, FilterDerainer):
        return getattr(method.filter, "FULL_SCALE", None)
    return SCALE_OF_UNIT.get(method.spec.intensity_unit) if isinstance(method, Derainer) else None


def _percent(part: int, whole: int) -> str:
    return number_text(float(ratio(part, whole)), ".2%")


if __name__ == "__main__":
    main()
