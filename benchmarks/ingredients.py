"""What each ingredient of a model gives: trains variants alike, and scores them in one table.

    python -m benchmarks.ingredients --plan benchmarks/ingredients.yaml --out ingredients

The file names data sets, each by the command of derain that makes it, and variants, each by the
options of its `derain fit`; `{name}` stands for the folder of a data set there. All are trained
with one seed, one after the other. A variant whose model is there, made by the same commands, is
not trained again: a sweep that was stopped goes on. What is scored on is that of
across_sensors.yaml or of another `--columns`, where labels have a part in the scores alone.
"""

import argparse
import sys
from pathlib import Path

from benchmarks.across_sensors import PLAN
from benchmarks.sensor_table.measure import Measurement
from benchmarks.sensor_table.plan import Asked, Plan
from benchmarks.sensor_table.report import add_places, report
from benchmarks.sensor_table.sweep import Sweep


def main() -> None:
    """Trains what is not there, prints the table, and exits with 1 where a variant failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plan", type=Path, default=Path(__file__).with_suffix(".yaml"))
    parser.add_argument("--variants", nargs="+", help="titles of those to train (default: all)")
    parser.add_argument("--columns", type=Path, default=PLAN, help="plan whose columns are scored")
    add_places(parser)
    parser.add_argument(
        "--models", type=Path, default=Path("runs/ingredients"), help="data sets and models"
    )
    arguments = parser.parse_args()

    sweep = Sweep.of_yaml(arguments.plan, arguments.models)
    columns = Plan.of_yaml(arguments.columns)  # read before anything is trained for it
    variants = [v for v in sweep.variants if v.title in (arguments.variants or (v.title,))]
    failed = {}
    for variant in variants:
        print(f"{variant.title}", file=sys.stderr, flush=True)
        if reason := sweep.train(variant):
            failed[variant.title] = reason
    rows = {
        title: Asked(str(sweep.model(variant)), settings)
        for variant in variants
        if variant.title not in failed
        for title, settings in variant.rows()
    }
    plan = columns.with_only(rows)
    measurement = Measurement(plan, arguments.shared, arguments.work, arguments.threads)
    measurement.left_out.reasons |= failed
    report(measurement, arguments.out, turned=False, notes=[sweep.told(v) for v in variants])
    raise SystemExit(bool(failed))


if __name__ == "__main__":
    main()
