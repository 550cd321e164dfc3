"""Prints how far a run is that keeps records: done, failed and missing units, and totals.

  derain status cleaned
  derain status cleaned --json
  derain status s3://bucket/cleaned

A unit is a recording, a bag, or a block of scans of a long recording. Runs of more than 50 scans
keep a record of each unit in the folder of --out, and so do runs by several processes or machines.
A failed unit is done again by the same command, and so is a missing one. For a run in shares of a
SLURM array, the last line has the tasks that are to be run again.
The exit code is 2 unless all units are done.
"""

import argparse
import json

from derain.cli.outputs import print_lines
from derain.cli.parser import Parser
from derain.jobs.status import JobStatus, job_status
from derain.sources.cleaned_totals import CleanedTotals
from derain.stores.url import place_of

# At most so many failed units are printed with their reasons.
MOST_FAILED = 20


def add_arguments(parser: Parser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("out", type=place_of, metavar="OUT", help="folder or URL that --out named")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    totals = CleanedTotals()
    status = job_status(arguments.out, totals.add)
    if arguments.json:
        print(json.dumps(_as_dict(status, totals)))
    else:
        print_lines("\n".join(_lines(status, totals)))
    return 0 if status.done == len(status.units) else 2


def _lines(status: JobStatus, totals: CleanedTotals) -> list[str]:
    lines = [
        f"{status.done:,} of {len(status.units):,} units done, {len(status.failed):,} failed, "
        f"{len(status.missing):,} missing",
        str(totals),
    ]
    if seconds := sum(status.seconds.values()):
        workers = len(status.seconds)
        lines.append(f"{totals.scans / seconds:.2f} scans a second a worker, {workers:,} workers")
    for hour, weather in totals.worst_hours():
        lines.append(f"visibility {weather.visibility}: {hour}")
    shown = status.failed[:MOST_FAILED]
    lines += [f"failed: {record.unit}: {record.failures[0]}" for record in shown]
    if len(status.failed) > MOST_FAILED:
        lines.append(f"failed: {len(status.failed) - MOST_FAILED:,} more units")
    if status.array is not None:
        lines.append(f"to be run again: --array={status.array}")
    return lines


def _as_dict(status: JobStatus, totals: CleanedTotals) -> dict[str, object]:
    return {
        "units": len(status.units),
        "done": status.done,
        "failed": {record.unit: str(record.failures[0]) for record in status.failed},
        "missing": [unit.id for unit in status.missing],
        "array": status.array,
        "scans": totals.scans,
        "points": totals.points,
        "valid": totals.valid,
        "rain": totals.rain,
        "seconds_by_worker": dict(status.seconds),
        "visibility_m_by_hour": {
            hour: weather.visibility.metres for hour, weather in totals.worst_hours(10)
        },
    }
