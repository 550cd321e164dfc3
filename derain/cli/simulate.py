"""Simulates a data set of rain, or adds rain to clean scans.

By default it simulates a rain facility in the layout of REHEARSE-3D: LiDAR, radar, both merged,
labels, weather. Every sequence is another track: 60 % for training, 20 % each for validation and
test. Training needs three or more sequences; one is enough to look at.

  derain simulate --out facility
  derain simulate --out look --sequences 1 --scans 1 --rain 50
  derain simulate --out heavy --rain 50 --sequences 5 --scans 20 --seed 1
  derain simulate --out quick --sensor mems_64 --no-radar --workers 1
  derain simulate --out streets --layout street
  derain simulate --out country --layout country --sensor spinning_64 --no-radar
  derain simulate --out drive --layout street --speed 13 --traffic 8 --sensor spinning_64

As in the real facility, only rain is near the sensor, and little else is as dim, so that rules of
position or of intensity find it. The streets have boughs and bushes between the drops. The other
layouts have many objects that look like drops: windows, nets, twigs, grass, and people near the
sensor. With --speed the sensor drives along a street, without a radar; with --traffic cars and
pedestrians move. derain then also writes poses.txt, and numbers moving objects in the upper 16 bits
of the labels.

The sequences use the rain rates in turn; 0 is clean. A second call continues an interrupted run;
`derain status` prints its progress. To train on the data set:

  derain fit --config outdet_simulated.yaml --data.root facility --data.make false

With --world every sequence is one scan of another place, sensor and weather, from drizzle to snow,
to train a model that works anywhere. A YAML file of your own sets what is drawn, as in
derain/simulation/worlds/world.yaml.

  derain simulate --out worlds --world --sequences 500
  derain fit --config cues_worlds.yaml --data Worlds --data.root worlds --data.make false

Many machines can make one data set in a folder that they share: with --dask, or one shard each. The
last one to end completes manifest.json. The bytes stay the same.

  derain simulate --out worlds --world --sequences 100000 --shard 0/4
  derain status worlds

With --on, derain adds rain to clean scans instead, in the format of the file with all its columns,
and writes <stem>.label (1 = rain).

  derain simulate --on clean/ --rain 25 --out rainy
  derain simulate --on scan.pcd --rain 50 --out rainy --sensor spinning_128 --picture

Simulated rain is easy: a score on it does not predict the score on real rain.
"""

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from derain.cli import outputs
from derain.cli.options import add_columns, add_seed, count
from derain.cli.unit_options import add_executor, add_shard, executor_of, shard_of
from derain.errors import InputError, counted
from derain.files import DEFAULT_COLUMNS
from derain.scan import Scan
from derain.simulation.campaign import FACILITY_RAIN_RATES, Campaign, Drive, partition
from derain.simulation.classes import TrackClass
from derain.simulation.dataset import simulate_track
from derain.simulation.layouts import LAYOUTS
from derain.simulation.radar import Radar
from derain.simulation.rain_field import UniformRain
from derain.simulation.recorded import rain_on_scan
from derain.simulation.sensor import load_sensor
from derain.simulation.world import WorldCampaign
from derain.sources.folders import named_frames
from derain.sources.judging import Failures
from derain.system.cores import usable_cores
from derain.system.extras import MATPLOTLIB, OPEN3D, require

# Options of a data set, and what each is where it is not given.
DATA_SET_DEFAULTS: dict[str, Any] = {
    "layout": "facility",
    "sequences": 10,
    "scans": 10,
    "radar": None,  # by what moves
    "speed": 0.0,
    "traffic": 0,
    "skew": False,
    "workers": None,  # one per core, unless --dask names others
    "dask": None,
    "shard": None,
}
OF_NO_WORLD = ("layout", "scans", "radar", "speed", "traffic", "skew")
SCAN_OPTIONS = ("columns", "picture")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument(
        "--rain",
        nargs="+",
        type=float,
        metavar="MM_H",
        help="rain rates in mm/h (default: 10 0 25 0 50, about as often clean as REHEARSE-3D)",
    )
    parser.add_argument(
        "--sensor",
        help="name of a packaged sensor, or YAML file (default: mems_256, with --on spinning_64)",
    )
    add_seed(parser)
    _add_data_set_options(parser.add_argument_group("a data set"))
    _add_scan_options(parser.add_argument_group("rain on scans"))


def _add_data_set_options(group: "argparse._ArgumentGroup") -> None:
    default = {name: f"(default: {value})" for name, value in DATA_SET_DEFAULTS.items()}
    group.add_argument(
        "--layout",
        choices=LAYOUTS,
        help=f"a test track under sprinklers, or random places in even rain {default['layout']}",
    )
    group.add_argument("--sequences", type=count, help=f"sequences {default['sequences']}")
    group.add_argument("--scans", type=count, help=f"scans per sequence {default['scans']}")
    group.add_argument(
        "--speed",
        type=float,
        metavar="M_S",
        help=f"speed of the sensor along the street, m/s {default['speed']}",
    )
    group.add_argument(
        "--traffic", type=int, help=f"cars and pedestrians that move {default['traffic']}"
    )
    group.add_argument(
        "--skew",
        action="store_true",
        default=None,
        help="let cars, pedestrians and the sensor move during a scan",
    )
    group.add_argument(
        "--radar",
        action=argparse.BooleanOptionalAction,
        help="simulate a 4D radar (default: yes, but not on a drive)",
    )
    add_executor(group, "processes (default: one per core)")
    add_shard(group)
    group.add_argument(
        "--world",
        nargs="?",
        const="world",
        metavar="YAML",
        help="draw place, sensor and weather of each scan at random, as YAML describes (default: "
        "the packaged world)",
    )


def _add_scan_options(group: "argparse._ArgumentGroup") -> None:
    group.add_argument("--on", nargs="+", type=Path, metavar="SCAN_OR_DIR", help="clean scans")
    add_columns(group, default=None)
    group.add_argument(
        "--picture", action="store_true", default=None, help="draw <stem>.png of each scan"
    )


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    if arguments.on is not None:
        _refuse((*DATA_SET_DEFAULTS, "world"), arguments, needs="without --on")
        return _rain_on_scans(arguments)
    require("simulate", OPEN3D)
    in_world = arguments.world is not None
    if in_world:
        foreign = (*OF_NO_WORLD, *SCAN_OPTIONS, "rain", "sensor")
        _refuse(foreign, arguments, needs="without --world")
    _refuse(SCAN_OPTIONS, arguments, needs="with --on")
    for name, value in DATA_SET_DEFAULTS.items():
        if getattr(arguments, name) is None:
            setattr(arguments, name, value)
    campaign = _campaign(arguments)
    with executor_of(arguments, arguments.workers or usable_cores()) as executor:
        complete = simulate_track(arguments.out, campaign, executor, shard_of(arguments))
    if not complete:
        outputs.print_lines(f"Progress of the other shards: derain status {arguments.out}")
        return 0
    sequences = len(campaign.names)
    scans = sequences * (1 if in_world else arguments.scans)
    outputs.print_lines(
        f"{arguments.out}: {counted(sequences, 'sequence')}, {counted(scans, 'scan')}. "
        f"To describe them: derain info {arguments.out}"
    )
    return 0


def _refuse(foreign: Iterable[str], arguments: argparse.Namespace, needs: str) -> None:
    """Refuses the options of other uses."""
    for name in foreign:
        if getattr(arguments, name) is not None:
            raise InputError(f"--{name}", f"works only {needs}", "Leave it out.")


def _campaign(options: argparse.Namespace) -> Campaign | WorldCampaign:
    """The campaign to simulate: sequences of tracks, or scans of worlds."""
    if options.world is not None:
        return WorldCampaign(*partition(options.sequences), seed=options.seed, world=options.world)
    moves = bool(options.speed or options.traffic)
    radar = not moves if options.radar is None else options.radar
    return Campaign(
        *partition(options.sequences),
        scans=options.scans,
        rain_rates=tuple(options.rain or FACILITY_RAIN_RATES),
        seed=options.seed,
        sensor=options.sensor or "mems_256",
        layout=options.layout,
        radar=Radar() if radar else None,
        drive=Drive(options.speed, options.traffic, options.skew) if moves else None,
    )


def _rain_on_scans(arguments: argparse.Namespace) -> int:
    """Adds rain to clean scans, writes them, and prints the changes of each."""
    if arguments.picture:
        require("--picture", MATPLOTLIB)
        from derain.pictures.scan_pictures import before_after_figure, save

    if not arguments.rain or len(arguments.rain) > 1:
        raise InputError("--rain", "scans take a single rain rate", "Give one, e.g. --rain 25.")
    rain, sensor = UniformRain(*arguments.rain), load_sensor(arguments.sensor or "spinning_64")
    source = named_frames(arguments.on, arguments.columns or DEFAULT_COLUMNS)
    sink = outputs.folder_sink(arguments.out, source)
    failures, written = Failures(outputs.print_error), 0
    with outputs.noting_progress(lambda: f"{written:,} of {len(source):,} scans are written"):
        for number, frame in enumerate(tqdm(source, unit="scan", disable=None)):
            seed = np.random.SeedSequence(arguments.seed, spawn_key=(number,))
            with failures.skipping_failures(frame):
                clean = frame.read()
                rainy = rain_on_scan(clean, rain, sensor, np.random.default_rng(seed))
                assert rainy.label is not None  # rain comes with labels
                drops = rainy.label == TrackClass.RAIN
                sink.write(frame, rainy, drops)
                if arguments.picture:
                    title = f"{Path(frame.key).name} in {rain.heaviest:g} mm/h of simulated rain"
                    figure = before_after_figure(rainy, drops, f"{title}, and without its drops")
                    save(figure, sink.path(frame, ".png"))
                written += 1
                _print_rain(frame.name, clean, rainy, int(drops.sum()))
    return outputs.exit_code(len(failures.errors), len(source), "no rain could be added to {scans}")


def _print_rain(name: str, clean: Scan, rainy: Scan, drops: int) -> None:
    """Prints the valid points of a scan before and after, how many are drops, and how many lost."""
    before, after = int(clean.valid.sum()), int(rainy.valid.sum())
    lost = before - (after - drops)
    outputs.print_line(
        f"{name}: {before:,} points, in the rain {after:,}: {drops:,} of drops, {lost:,} lost"
    )
