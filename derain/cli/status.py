"""Prints the progress of a command over many scans: done, failed and missing units, and totals.

  derain status cleaned
  derain status worlds --json
  derain status s3://bucket/cleaned

A unit is a recording, a bag, or a block of scans of a long recording; for simulate it is a
sequence. run, teach and bench keep a record of each unit in the --out folder for more than 50
scans, several processes or several machines; simulate always does, and info if --out names a
folder. The same command repeats failed units and does missing ones. For shards of a SLURM array,
the last line lists the tasks to run again. The exit code is 2 unless all units are done.
"""

import argparse
import json

from derain.cli.outputs import print_lines
from derain.cli.parser import Parser
from derain.errors import counted
from derain.jobs.job import Job, JobStatus, job_status
from derain.sources.cleaned_scan import CleanedTotals
from derain.stores.url import place_of

# At most this many failed units are printed with their reasons.
MOST_FAILED = 20


def add_arguments(parser: Parser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("out", type=place_of, metavar="OUT", help="folder or URL that --out named")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    is_run = Job.at(arguments.out).options.get("command") == "run"
    cleaned = CleanedTotals() if is_run else None
    status = job_status(arguments.out, (lambda _: None) if cleaned is None else cleaned.add)
    if arguments.json:
        print(json.dumps(_as_dict(status, cleaned)))
    else:
        print_lines("\n".join(_lines(status, cleaned)))
    return 0 if status.done == len(status.units) else 2


def _lines(status: JobStatus, cleaned: CleanedTotals | None) -> list[str]:
    lines = [
        f"{status.done:,} of {len(status.units):,} units done, {len(status.failed):,} failed, "
        f"{len(status.missing):,} missing"
    ]
    done, what = status.done, "units"
    if cleaned is not None:
        lines.append(str(cleaned))
        done, what = cleaned.scans, "scans"
    if seconds := sum(status.seconds.values()):
        workers = counted(len(status.seconds), "worker")
        lines.append(f"{done / seconds:.2f} {what} a second a worker, {workers}")
    if cleaned is not None:
        hours = cleaned.worst_hours()
        lines += [f"visibility {weather.visibility}: {hour}" for hour, weather in hours]
    shown = status.failed[:MOST_FAILED]
    lines += [f"failed: {record.unit}: {record.failures[0]}" for record in shown]
    if len(status.failed) > MOST_FAILED:
        more = len(status.failed) - MOST_FAILED
        lines.append(f"failed: {counted(more, 'more unit')}")
    if status.array is not None:
        lines.append(f"to be run again: --array={status.array}")
    return lines


def _as_dict(status: JobStatus, cleaned: CleanedTotals | None) -> dict[str, object]:
    facts: dict[str, object] = {
        "units": len(status.units),
        "done": status.done,
        "failed": {record.unit: str(record.failures[0]) for record in status.failed},
        "missing": [unit.id for unit in status.missing],
        "array": status.array,
        "seconds_by_worker": dict(status.seconds),
    }
    if cleaned is not None:
        facts |= {
            "scans": cleaned.scans,
            "points": cleaned.points,
            "valid": cleaned.valid,
            "rain": cleaned.rain,
            "visibility_m_by_hour": {
                hour: weather.visibility.metres for hour, weather in cleaned.worst_hours(10)
            },
        }
    return facts
