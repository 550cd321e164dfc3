"""Prints one table: methods on data of many sensors, and the points they remove from clean scans.

    python -m benchmarks.across_sensors --shared ../shared --out table
    python -m benchmarks.across_sensors --models mine=model.onnx --times 0 --out table
    python -m benchmarks.across_sensors --data "WADS sample" --out times

Rows and columns are those of across_sensors.yaml, or of another `--plan`; `--models` adds rows.
Simulated data are made below `--work` and reused. Missing data are left out, with the reason.
Labels are used for the scores alone.
"""

import argparse
from pathlib import Path

from benchmarks.sensor_table.measure import Measurement
from benchmarks.sensor_table.plan import Plan, Row
from benchmarks.sensor_table.report import add_places, report

PLAN = Path(__file__).with_name("across_sensors.yaml")


def main() -> None:
    """Prints the table, and writes it as Markdown, as JSON and as a picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plan", type=Path, default=PLAN, help="rows and columns")
    parser.add_argument("--models", nargs="+", default=[], metavar="TITLE=MODEL", help="more rows")
    parser.add_argument("--data", nargs="+", metavar="TITLE", help="these labelled data alone")
    add_places(parser)
    parser.add_argument("--times", type=int, default=15, help="timed runs of each method, or 0")
    parser.add_argument("--turned", action="store_true", help="a row for each data set")
    arguments = parser.parse_args()

    models = dict(text.split("=", 1) for text in arguments.models)
    rows = {title: Row(model) for title, model in models.items()}
    plan = Plan.of_yaml(arguments.plan).with_methods(rows)
    measurement = Measurement(
        plan if arguments.data is None else plan.with_data(arguments.data),
        arguments.shared,
        arguments.work,
        arguments.threads,
        arguments.times,
    )
    report(measurement, arguments.out, arguments.turned)


if __name__ == "__main__":
    main()
