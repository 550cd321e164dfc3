"""Finds the parameters of a filter, or the threshold of a model, with the greatest IoU of rain.

It writes them for `derain run --parameters` and `derain bench --methods`.

  derain tune dsor --data scans/ --card wads --out dsor.yaml
  derain tune dror --data REHEARSE3D_PUBLIC --scans 100 --trials 100 --out dror.yaml
  derain tune dror --data REHEARSE3D_PUBLIC --trials 300 --storage dror.journal --out dror.yaml
  derain tune outdet.onnx --data REHEARSE3D_PUBLIC --out outdet.yaml
  derain tune default --data scans/ --card wads --out default.yaml

Optuna searches the parameters of a filter, starting at the defaults. The neighbours of each scan
are found once, and take about 150 bytes per point. With --storage, a second call continues up to
--trials, and simultaneous calls share the trials; call it once more at the end for the best of all.
Several machines need a journal in a folder that all of them see, or a database:
postgresql+psycopg://USER@HOST/DATABASE. With --candidates, the filter looks for rain only within
bounds of range, height and intensity that hold a share of the rain. The threshold of a model
follows from its probabilities, without trials.
"""

import argparse
import os
from pathlib import Path

import numpy as np

from derain import __version__
from derain.cli import options
from derain.cli.method_options import list_methods
from derain.cli.outputs import print_lines
from derain.cli.parser import Parser
from derain.default import DEFAULT
from derain.errors import InputError, counted
from derain.export.storage import Storage
from derain.files.atomic import require_writable
from derain.filters import FILTERS
from derain.filters.derainer import CANDIDATES
from derain.system.extras import OPTUNA, require
from derain.views.candidate_fit import RAIN_INSIDE


def add_arguments(parser: Parser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("method", metavar="METHOD", help="ONNX file, default or a filter (below)")
    list_methods(parser, of_recordings=False)
    options.add_data(parser, part="validation")
    parser.add_argument(
        "--out", type=options.file_named(".yaml", ".yml"), required=True, help="YAML file to write"
    )
    parser.add_argument(
        "--scans", type=options.count, default=100, help="number of random scans (default: 100)"
    )
    parser.add_argument(
        "--trials", type=options.count, default=100, help="trials for a filter (default: 100)"
    )
    options.add_seed(parser)
    parser.add_argument(
        "--candidates",
        type=options.share,
        nargs="?",
        const=RAIN_INSIDE,
        metavar="SHARE",
        help="limit a filter to bounds that hold SHARE of the rain (default SHARE: %(const)s)",
    )
    parser.add_argument(
        "--storage",
        type=Storage,
        metavar="PLACE",
        help="for the trials of a filter: FILE.journal, an SQLite file, or the URL of a database",
    )
    options.add_threads(parser)


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    method, threads = arguments.method, arguments.threads
    if method in FILTERS:
        require("tune", OPTUNA)
    from derain.workflows import tuning

    data = options.labelled(arguments.data, arguments, arguments.topic)
    frames = data.frames(arguments.part)
    generator = np.random.default_rng(arguments.seed)
    most = min(arguments.scans, len(frames))
    drawn = [frames[n] for n in np.sort(generator.choice(len(frames), most, replace=False))]
    require_writable(arguments.out)
    if method in FILTERS:
        candidates = None
        if arguments.candidates is not None:
            candidates = tuning.bounds_of_rain(data, drawn, arguments.candidates)
            every = "every point: no bounds separate rain from the rest"
            print_lines(f"candidates: {candidates or every}")
        tuned = tuning.tune_filter_on(
            method,
            data,
            drawn,
            arguments.trials,
            seed=arguments.seed,
            storage=arguments.storage,
            candidates=candidates,
            threads=threads,
        )
    elif arguments.candidates is not None:
        raise InputError("--candidates", "a model has its own", "Give it to `derain export`.")
    else:
        tuned = tuning.tune_model_on(method, data, drawn, threads)
    facts = (
        f"IoU {tuned.iou:.4f} on {counted(len(drawn), 'scan')} of {data.card.name}, "
        f"{tuned.default_iou:.4f} with the defaults"
    )
    command = f"derain {__version__}: {options.command_line(arguments, 'method')}"
    named = method
    if method != DEFAULT and method not in FILTERS:  # a model, named by the way from the YAML file
        folder = arguments.out.parent.resolve()
        named = Path(os.path.relpath(Path(method).resolve(), folder)).as_posix()
    tuning.write_parameters(arguments.out, named, tuned.parameters, command, facts)
    print_lines(f"{method}: {facts}")
    for name, value in tuned.parameters.items():
        if name != CANDIDATES:  # printed already
            print(f"  {name}: {value}")
    return 0
