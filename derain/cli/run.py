"""``derain run``: cleans scans with an exported model or a filter."""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from derain.cli.arguments import add_threads, share
from derain.cli.bag_options import add_cleaned_bags, add_topic, cleaned_bags, in_topic
from derain.cli.method_options import add_parameters, method_of
from derain.cli.method_or_scans import RULE, add_method_and_scans, method_and_scans
from derain.cli.outputs import (
    folder_sink,
    noting_what_is_written,
    refuse_taken,
    say,
    tell,
)
from derain.cli.pose_options import add_poses, placed
from derain.cli.probability_column import refuse_improbable, with_probability
from derain.cli.runtime_options import add_runtime
from derain.cli.scan_by_scan import ScanByScan
from derain.cli.scan_options import add_columns, add_intensity_scale
from derain.cli.told_weather import ToldWeather
from derain.cli.weather_options import WeatherWatch, add_weather
from derain.default import DEFAULT, model_card
from derain.errors import InputError, printable
from derain.sources.cleaned_bags import RAIN_PROBABILITY, CleanedBags
from derain.sources.folders import named_frames
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.judging import judgements
from derain.sources.method import Method
from derain.sources.recordings import irregularities
from derain.sources.sink import Sink
from derain.sources.source import Source
from derain.system.memory import keep_freed_memory
from derain.system.notices import Notices, warn
from derain.system.stopwatch import Stopwatch
from derain.views.oddities import HEAVIEST_RAIN, MOST_RAIN, left_out, much_removed, no_points

SUMMARY = "clean scans on a CPU, without torch"

DESCRIPTION = f"""\
Cleans scans: writes <stem>.label (1 = rain, one per row of the input) and the scan without its
rain, in the input's format with every field kept. With --weather, --fail-at, --dry or --json it
measures how bad the weather is in every scan; else in five scans, for the last line alone.

  derain run scans/ --out cleaned
  derain run model.onnx scan.bin --out cleaned
  derain run model.onnx scans/ more/scan.pcd --out cleaned --threads 2 --json
  derain run model.onnx nuscenes/ --out cleaned --columns x,y,z,intensity,ring
  derain run model.onnx scans/ --out cleaned --runtime openvino --precision bf16
  derain run dror scans/ --out cleaned
  derain run dror WADS/ --out cleaned
  derain run best.yaml scans/ --out cleaned
  derain run dsor scans/ --out cleaned --parameters best.yaml --set range_multiplier=0.08
  derain run persistence recording/ --out cleaned --poses poses.txt
  derain run drive.mcap --out cleaned --removed-topic /rain
  derain run scans/ --out cleaned --removed removed --probability
  derain run scans/ --out cleaned --weather weather.csv --warning 30 40 --error 15 20 --hold 5
  derain run scans/ --out cleaned --json --fail-at error

METHOD is a model written by `derain export` (.onnx), parameters that `derain tune` wrote (.yaml),
or a name (below).
{RULE}
For a method that sees several scans, those of a recording have to come in time order. Where a
method is not sure of a point, its best guess decides. Of a data set, results are named by their
paths in it.
Of a bag (.bag of ROS 1; .mcap, .db3 or the folder of ROS 2), a bag of its name is written, in which
the clouds of one topic have no rain and everything else is as it was, byte for byte.
What is odd about a scan is warned of, each fault once. A scan is left whole where more than
--most-removed of its valid points are called rain: no file is written for it, and in a bag its
cloud stays as it is. It and a scan that cannot be read are reported; the exit code is then 2.
Visibility is the range that 90 % of the rays would get through if rain met them everywhere as often
as in the first 10 m. It compares scans of one sensor, and is not what a weather station measures.
Fog that returns nothing shows only beside dry scans of the sensor, with --dry.
Where every scan was cleaned and one was at the level of --fail-at or worse, the exit code is 3.
"""


@dataclass(frozen=True)
class Cleaned:
    """What was done to one scan.

    Attributes:
        scan: Its file.
        points: Its points.
        valid: Those of them that can be judged.
        rain: Those of them that were removed.
        share_removed: Share of ``rain`` in ``valid``.
        not_known: Those of ``valid`` of which the method is not sure; None of one that says nothing
            of that.
        milliseconds: By stage.
        warnings: What is odd about it.
        weather: How bad the weather is that it shows; None where no option asks for it.
    """

    scan: str
    points: int
    valid: int
    rain: int
    share_removed: float
    not_known: int | None
    milliseconds: dict[str, float]
    warnings: list[str]
    weather: ToldWeather | None

    def __str__(self) -> str:
        name, total = printable(self.scan), sum(self.milliseconds.values())
        unsure = "" if self.not_known is None else f", {self.share_not_known:.1%} not known"
        weather = "" if self.weather is None else f", {self.weather}"
        return (
            f"{name}: {_counts(self.points, self.valid, self.rain)}{unsure}{weather}, "
            f"{total:.0f} ms"
        )

    @property
    def share_not_known(self) -> float:
        """Share of ``not_known`` in ``valid``."""
        return (self.not_known or 0) / max(self.valid, 1)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    add_method_and_scans(parser, help="scans, folders of scans, or a data set's folder")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    add_threads(parser)
    add_runtime(parser, help="what runs the model")
    parser.add_argument("--json", action="store_true", help="print one JSON object a scan")
    add_columns(parser)
    add_intensity_scale(parser)
    parser.add_argument(
        "--most-removed",
        type=share,
        default=MOST_RAIN,
        metavar="SHARE",
        help="leave a scan whole if a greater share of its valid points is called rain (default: "
        "%(default)g; 1 cleans every scan)",
    )
    parser.add_argument(
        "--removed", type=Path, metavar="DIR", help="write what is taken away of the scans too"
    )
    parser.add_argument(
        "--probability",
        action="store_true",
        help=f"write how probable rain is as the column {RAIN_PROBABILITY} of the scans",
    )
    add_parameters(parser)
    add_poses(parser)
    add_topic(parser)
    add_cleaned_bags(parser)
    add_weather(parser)


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    keep_freed_memory()
    arguments.method, arguments.scans = method_and_scans(arguments)
    method = method_of(arguments)
    scans = in_topic(arguments.scans, arguments)
    source = placed(named_frames(scans, arguments.columns), arguments)
    if arguments.probability:
        refuse_improbable(method, source)
    sink = folder_sink(arguments.out, source, arguments.removed)
    weather = WeatherWatch(arguments, source)
    with cleaned_bags(arguments, source) as bags:
        if arguments.weather is not None:
            written = (path for frame in source for path in sink.files_of(frame))
            refuse_taken("--weather", arguments.weather, [*written, *bags.targets()])
        return _clean(source, _Cleaning(method, sink, bags, weather, arguments), arguments)


def _clean(source: Source, cleaning: "_Cleaning", arguments: argparse.Namespace) -> int:
    """Cleans every scan, and gives the exit code."""
    method = cleaning.method
    stream = sys.stderr if arguments.json else sys.stdout
    if arguments.method == DEFAULT:
        say(
            f"by the model that comes with derain: {model_card().title}; what it is, and when not "
            f"to use it: derain info {DEFAULT}",
            stream,
        )
    for sentence in irregularities(source, method.window):
        warn(sentence)
    in_unit = source.map(lambda frame: frame.with_intensity_times(arguments.intensity_scale))
    scans = ScanByScan(in_unit)
    so_far = partial(cleaning.so_far, source)
    with cleaning.weather.writing(), noting_what_is_written(so_far):
        for frame, judgement, stopwatch in judgements(method, scans, scans.passing_over):
            with scans.passing_over(frame):
                cleaning.write(frame, judgement, stopwatch)
        cleaning.notices.tell_how_many_more()
        if len(cleaning.done) > 1:
            print(_summary(cleaning.done, cleaning.weather), file=stream, flush=True)
    return scans.exit_code("{scans} could not be cleaned") or cleaning.weather.exit_code()


class _Cleaning:
    """What writes the clean scans, and remembers what was done."""

    def __init__(
        self,
        method: Method,
        sink: Sink,
        bags: CleanedBags,
        weather: WeatherWatch,
        arguments: argparse.Namespace,
    ) -> None:
        self.method = method
        self.sink = sink
        self.bags = bags
        self.weather = weather
        self.arguments = arguments
        self.notices = Notices()
        self.done: list[Cleaned] = []
        self._files = 0

    def so_far(self, source: Source) -> str:
        """How many of the scans in files, and of the bags, are written."""
        scans = sum(not self.bags.takes(frame) for frame in source)
        parts = (
            (self._files, scans, "scans"),
            (len(self.bags.written), len(self.bags.targets()), "bags"),
        )
        return (
            " and ".join(
                f"{written:,} of {there:,} {what}" for written, there, what in parts if there
            )
            + " are written, each of them whole"
        )

    def write(self, frame: Frame, judgement: Judgement, stopwatch: Stopwatch) -> None:
        """Writes a scan without what is rain of it; where that is not known, the guess decides."""
        scan, rain = judgement.scan, judgement.rain
        valid, removed = int(scan.valid.sum()), int(rain.sum())
        share_removed = judgement.share_of_rain
        odd = [*self.method.oddities(judgement), *left_out(scan), *no_points(scan)]
        left_whole = share_removed > self.arguments.most_removed
        if not left_whole:
            odd += much_removed(share_removed)
        self.notices.tell(frame.name, odd)
        if left_whole:
            raise InputError(
                frame.name,
                f"left whole, for {share_removed:.1%} of its valid points are called rain, where "
                f"the heaviest rain has {HEAVIEST_RAIN:.0%}",
                "See whether the method suits sensor and unit of intensity, or raise "
                "--most-removed.",
            )
        with stopwatch.stage("weather"):
            seen = judgement.weather if self.weather.wants(frame) else None
        with stopwatch.stage("write"):
            if self.bags.takes(frame):
                self.bags.write(judgement)
            else:
                self._write_scans(frame, judgement)
        weather = None if seen is None else self.weather.look(frame, seen)
        told = [oddity.detail for oddity in odd]
        times = dict(stopwatch.milliseconds)
        unsure = None if judgement.known is None else int((scan.valid & ~judgement.answered).sum())
        cleaned = Cleaned(
            frame.name, len(scan), valid, removed, share_removed, unsure, times, told, weather
        )
        self.done.append(cleaned)
        tell(cleaned, self.arguments.json)

    def _write_scans(self, frame: Frame, judgement: Judgement) -> None:
        """Writes the cleaned scan, and what was taken away where that is asked for."""
        rain = judgement.rain
        scan = with_probability(frame, judgement) if self.arguments.probability else judgement.scan
        removed = None if self.arguments.removed is None else scan.take(rain)
        self.sink.write(frame, scan.take(~rain), rain, removed)
        self._files += 1


def _summary(done: Sequence[Cleaned], weather: WeatherWatch) -> str:
    """What was done to all scans together."""
    points = sum(item.points for item in done)
    valid, removed = sum(item.valid for item in done), sum(item.rain for item in done)
    odd = sum(bool(item.warnings) for item in done)
    return (
        f"{len(done):,} scans: {_counts(points, valid, removed)}, {weather}; "
        f"{odd:,} scans with warnings"
    )


def _counts(points: int, valid: int, rain: int) -> str:
    """How many points there are, how many can be judged, and how many of these are rain."""
    return (
        f"{points:,} points, {valid:,} valid, {rain:,} of rain ({rain / max(valid, 1):.1%} of the "
        "valid)"
    )
