"""Cleans scans with an exported model or a filter: removes rain and snow.

Writes <stem>.label (1 = rain, one per row of the input) and the scan without its rain, in the
format of the input with all its fields.

  derain run example --out cleaned            two simulated scans that come with derain
  derain run scans/ --out cleaned
  derain run drive/ --out cleaned --poses poses.txt
  derain run model.onnx scan.bin --out cleaned
  derain run dror scans/ --out cleaned --removed removed
  derain run drive.mcap --out cleaned --removed-topic /rain
  derain run scans/ --out cleaned --weather weather.csv
  derain run s3://bucket/drives --out s3://bucket/cleaned

  derain run model.onnx scans/ more/scan.pcd --out cleaned --threads 2 --json
  derain run model.onnx nuscenes/ --out cleaned --columns x,y,z,intensity,ring
  derain run model.onnx scans/ --out cleaned --runtime openvino --precision bf16
  derain run dror WADS/ --out cleaned
  derain run best.yaml scans/ --out cleaned
  derain run dsor scans/ --out cleaned --parameters best.yaml --set range_multiplier=0.08
  derain run persistence recording/ --out cleaned --poses poses.txt
  derain run drive/ --out cleaned --past 3 --delay 0
  derain run scans/ --out cleaned --removed removed --probability
  derain run scans/ --out cleaned --weather weather.csv --warning 30 40 --error 15 20 --hold 5
  derain run scans/ --out cleaned --json --fail-at error

METHOD is a model from `derain export` (.onnx), parameters from `derain tune` (.yaml), or a name
(below).
METHOD is optional: if the first word is a folder or a scan, the model that comes with derain cleans
all scans. Write ./crf for a folder called crf.
The model that comes with derain compares each scan of a recording with the scans around it: solid
things stay in place, rain does not. The positions of the sensor come from the poses, or else from
odometry. Without positions, or with --alone, derain judges each scan by itself.
Methods that need several scans take the scans of a recording in time order. Points stay if the
method is not sure of them. Results of a data set have the same paths as its scans.
A bag (.bag of ROS 1; .mcap, .db3 or a folder of ROS 2) becomes a bag of the same name: the clouds
of one topic lose their rain, and everything else stays the same, byte for byte.
derain warns once of each fault of the scans. It skips scans with more than --most-removed rain: it
writes no file for them, and does not change such clouds of bags. It also skips scans that it cannot
read. The exit code is then 2.
With --weather, --fail-at, --dry or --json it measures the weather of every scan. Otherwise it
measures five scans, for the last line.
Visibility is the range that 90 % of the rays would reach if rain were as dense everywhere as in the
first 10 m. It compares scans of one sensor; a weather station measures something else. Fog without
returns shows only in comparison with dry scans of the sensor (--dry).
The exit code is 3 if derain cleaned every scan and one was at the level of --fail-at or worse.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path

from derain.cli import options, unit_options, weather_options
from derain.cli.method_options import add_method_and_scans, method_and_scans, method_of
from derain.cli.outputs import exit_code, noting_progress, print_error, print_facts, print_lines
from derain.cli.parser import Parser
from derain.default import DEFAULT, model_card
from derain.errors import InputError, printable
from derain.example import Truth
from derain.export.methods import DELAY, PAST, over_recording
from derain.export.runtime import Derainer
from derain.files.labels import LABEL
from derain.sources.bag_frame import BagFrame
from derain.sources.clean_sink import CleanSink
from derain.sources.cleaned_bags import RAIN_PROBABILITY, BagOptions
from derain.sources.cleaned_scan import ScanOutcome
from derain.sources.cleaning import CleanReport, clean
from derain.sources.method import Method
from derain.sources.recordings import irregularities
from derain.sources.store_listing import frames_at
from derain.sources.stored_frame import StoredBag
from derain.sources.window import MOST_SCANS
from derain.stores.url import Place, is_url, place_of
from derain.system.notices import Notices, warn
from derain.views.scan_issues import MOST_RAIN
from derain.weather.record import weather_row

# Options that only --help-all shows.
RARE = (
    *("--runtime", "--precision", "--parameters", "--columns", "--intensity-scale"),
    *("--probability", "--most-removed", "--past", "--delay", "--topic", "--cleaned-topic"),
    *("--removed-topic", "--keep-shape", "--dry", "--warning", "--error", "--hold"),
    *("--resume", "--anew", "--shard", "--dask", "--block"),
)


def add_arguments(parser: Parser) -> None:
    """Declares the command's arguments."""
    text = "scans, folders of scans or of recordings, data sets, bags, or URLs"
    add_method_and_scans(parser, help=text)
    parser.add_argument("--out", type=place_of, required=True, help="folder or URL to write to")
    options.add_json(parser)
    options.add_columns(parser)
    options.add_intensity_scale(parser)
    parser.add_argument(
        "--most-removed",
        type=options.share,
        default=MOST_RAIN,
        metavar="SHARE",
        help="skip scans with more than SHARE rain among their valid points (default: %(default)g; "
        "1 cleans every scan)",
    )
    parser.add_argument(
        "--removed", type=place_of, metavar="DIR", help="write the removed points to DIR"
    )
    parser.add_argument(
        "--probability", action="store_true", help=f"add the column {RAIN_PROBABILITY} to the scans"
    )
    around = partial(options.count, least=0, most=MOST_SCANS)
    parser.add_argument(
        "--past", type=around, metavar="N", help=f"use N scans before each scan (default: {PAST})"
    )
    parser.add_argument(
        "--delay", type=around, metavar="N", help=f"use N scans after each scan (default: {DELAY})"
    )
    parser.add_argument("--alone", action="store_true", help="judge each scan by itself")
    options.add_poses(parser)
    options.add_topic(parser)
    parser.add_argument(
        "--cleaned-topic",
        metavar="NAME",
        help="bags: add a topic of clean clouds (default: replace the clouds)",
    )
    parser.add_argument(
        "--removed-topic", metavar="NAME", help="bags: add a topic of the removed points"
    )
    parser.add_argument(
        "--keep-shape",
        action="store_true",
        help="bags: keep rows and columns of organised clouds; removed points become NaN",
    )
    weather_options.add_weather(parser)
    unit_options.add_units(parser)
    parser.use_rarely(*RARE)


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    name, scans = method_and_scans(arguments.method, arguments.scans or [])
    division = unit_options.division_of(arguments)
    single_scan_method = method_of(name, arguments)
    results = [folder for folder in (arguments.out, arguments.removed) if folder is not None]
    frames = frames_at(scans, arguments.columns, arguments.topic, results)
    source = unit_options.prepared(frames, arguments)
    if arguments.probability and not single_scan_method.gives_probabilities:
        raise InputError(
            "--probability",
            f"{single_scan_method.as_dict()['method']} returns which points are rain, without "
            "probabilities",
            "Leave it out, or take a model or persistence.",
        )
    # The number of clouds of a bag in a store is known only after fetching it.
    several = len(source) > 1 or isinstance(source[0], StoredBag)
    method, workers = unit_options.method_and_workers(
        _with_scans_around(single_scan_method, arguments, several),
        lambda: _with_scans_around(method_of(name, arguments), arguments, several),
        source,
        arguments,
    )
    weather = weather_options.weather_of(arguments)
    sink = CleanSink(
        arguments.out,
        source,
        removed=arguments.removed,
        probability=arguments.probability,
        bags=BagOptions(arguments.cleaned_topic, arguments.removed_topic, arguments.keep_shape),
    )
    with (
        sink,
        weather_options.weather_table(arguments.weather, sink.targets()) as rows,
        unit_options.executor_of(arguments, workers) as executor,
    ):
        printer = _Printer(arguments.out, rows, arguments.json)
        if name == DEFAULT:
            printer.introduce_default()
        needed = not single_scan_method.window.is_one_scan
        # Times of a bag are known when it has been read through.
        unread = StoredBag if needed else StoredBag | BagFrame
        listed = (frame for frame in source if not isinstance(frame, unread))
        for sentence in irregularities(listed, method.window, needed=needed):
            warn(sentence)
        with noting_progress(lambda: printer.so_far(len(source))):
            report = clean(
                source,
                method,
                sink,
                most_removed=arguments.most_removed,
                weather=weather,
                watch=printer.take,
                division=division,
                executor=executor,
            )
            printer.summarise(report)
    total = len(report.scans) + report.not_cleaned
    code = exit_code(report.not_cleaned, total, "{scans} could not be cleaned")
    return code or weather_options.warn_of_bad_weather(report.weather, arguments.fail_at)


def _with_scans_around(method: Method, arguments: argparse.Namespace, several: bool) -> Method:
    """Wraps a model to use the scans around each scan, if the options or the model need it.

    Args:
        method: The method for one scan at a time.
        arguments: The options.
        several: True if there are several scans.

    Returns:
        The wrapped model, or the method itself.

    Raises:
        InputError: ``--past`` or ``--delay`` with a method that is no model, or with ``--alone``;
            ``--alone`` with a method that needs several scans.
    """
    past, delay = arguments.past, arguments.delay
    is_set = past is not None or delay is not None
    if arguments.alone and (is_set or not method.window.is_one_scan):
        reason = "excludes --past and --delay, and methods that need several scans"
        raise InputError("--alone", reason, "Leave it out.")
    if not is_set:
        return over_recording(method) if several and not arguments.alone else method
    if not isinstance(method, Derainer):
        raise InputError("--past, --delay", "are options of models", "Leave them out.")
    from derain.export.recorded import RecordedDerainer  # a single scan needs no odometry

    return RecordedDerainer(
        method, PAST if past is None else past, DELAY if delay is None else delay
    )


class _Printer:
    """Prints the results, and collects one row of the weather table per scan.

    Attributes:
        cleaned: Number of scans that are cleaned.
    """

    def __init__(self, out: Place, rows: list[Sequence[object]], as_json: bool) -> None:
        self._out = out
        self._notices = Notices()
        self._rows = rows
        self._as_json = as_json
        self.cleaned = 0
        self._example = Truth()
        self._stream = sys.stderr if as_json else sys.stdout

    def introduce_default(self) -> None:
        """Prints the name of the default model."""
        print_lines(
            f"by the model that comes with derain: {model_card().title}; what it is, and when not "
            f"to use it: derain info {DEFAULT}",
            self._stream,
        )

    def summarise(self, report: CleanReport) -> None:
        """Prints the summary of all scans."""
        self._notices.warn_of_repeats()
        if not report.scans and not report.not_cleaned:
            print_lines("no scans in this shard", self._stream)
        if len(report.scans) > 1:
            print(report, file=self._stream, flush=True)
        if self._example.rain:
            look = "Look at it: derain view example --out figure.png"
            print_lines(f"{self._example} {look}", self._stream)

    def so_far(self, scans: int) -> str:
        """Number of scans that are written, of a number of scans."""
        count = f"{self.cleaned:,} of {scans:,} scans are written"
        return f"{count} (clouds of a bag, when all of it is cleaned)"

    def take(self, outcome: ScanOutcome) -> None:
        """Prints the warnings and the results of a scan, or its error, and adds a row."""
        self._notices.warn(outcome.frame.name, outcome.issues)
        if outcome.error is not None:
            print_error(outcome.error)
            return
        self.cleaned += 1
        scan = outcome.figures
        if scan.weather is not None and (measured := outcome.measured) is not None:
            row = weather_row(scan.weather, measured)
            self._rows.append([printable(scan.scan), outcome.seconds, *row])
        if outcome.was_there:
            return
        print_facts(asdict(scan), str(scan), self._as_json)
        if not is_url(self._out):
            self._example.add(outcome.frame.name, Path(self._out, f"{outcome.frame.key}{LABEL}"))
