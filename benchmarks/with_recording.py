"""Measures the gain of a recording: a model alone, with the scan before, with both, persistence.

    python -m benchmarks.with_recording --shared ../shared --out recordings.md

Data sets of `across_sensors.yaml` whose scans follow each other. Prints a table of IoU and of the
milliseconds a scan.
"""

import argparse
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks.across_sensors import PLAN
from benchmarks.sensor_table.inputs import DataFinder
from benchmarks.sensor_table.plan import Plan
from derain.default import DEFAULT
from derain.evaluation.scores import score
from derain.evaluation.text_tables import markdown_table
from derain.export.bench.labelled_frames import LabelledFrames
from derain.export.recorded import RecordedDerainer
from derain.export.runtime import Derainer
from derain.recordings.persistence import PersistenceDerainer
from derain.sources.judging import judgements
from derain.sources.method import Method
from derain.system.memory import keep_freed_memory

RECORDINGS = (
    *("WADS drive", "SnowyKITTI", "demonstration's streets"),
    *("streets, spinning_128", "streets, spinning_32_far"),
)


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shared", type=Path, default=Path("../shared"), help="scans")
    parser.add_argument(
        "--work", type=Path, default=Path("runs/across_sensors"), help="what is made on the way"
    )
    parser.add_argument("--model", default=DEFAULT, help="model that is used (default: default)")
    parser.add_argument("--data", nargs="+", default=RECORDINGS, metavar="TITLE")
    parser.add_argument("--out", type=Path, help="file for the table")
    arguments = parser.parse_args()
    keep_freed_memory()  # as `derain run` does
    methods: dict[str, Callable[[], Method]] = {
        "alone": lambda: Derainer(arguments.model),
        "with the scan before": lambda: RecordedDerainer(Derainer(arguments.model), 1, 0),
        "with the scans before and after": lambda: RecordedDerainer(
            Derainer(arguments.model), 1, 1
        ),
        "persistence": PersistenceDerainer,
    }
    plan = Plan.of_yaml(PLAN)
    finder = DataFinder(arguments.shared, arguments.work / "simulated")
    rows = []
    for title in arguments.data:
        found = finder.measured(plan.labelled[title])
        cells = [_measured(make(), found) for make in methods.values()]
        rows.append([f"{title} ({len(found.frames)} scans)", *cells])
    table = markdown_table(["data", *methods], rows)
    print(table)
    if arguments.out:
        arguments.out.write_text(table, "utf-8")


def _measured(method: Method, found: LabelledFrames) -> str:
    """IoU of a method over the scans, and the time of each."""
    begin = time.perf_counter()
    answers = judgements(method, [frame.without_labels() for frame in found.frames])
    rain = [judgement.rain for _, judgement, _ in answers]
    milliseconds = 1e3 * (time.perf_counter() - begin) / len(rain)
    in_turn = iter(rain)
    reader = found.reader
    scans = map(reader.read, found.frames)
    (scores,) = score([lambda _: next(in_turn)], scans, reader.card, reader.distinct)
    return f"{scores.pooled.iou:.3f}, {milliseconds:.0f} ms"


if __name__ == "__main__":
    main()
