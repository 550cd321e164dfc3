"""Gives every reader damaged files, and prints the outcomes.

    python -m benchmarks.fuzz --inputs 100000 --workers 2
    python -m benchmarks.fuzz --replay runs/fuzz/pcd-0-1234

Readers are those of scans, labels, bags, small documents, exported models and checkpoints, and
`resume`, a training that goes on from a checkpoint. An input must give a right result or be refused
with an InputError; anything else is a finding: another exception, the end of the process, more than
1 GB of memory or 10 seconds of computing. Findings lie in --out. The exit code is 1 if there are
any.
"""

import argparse
import shutil
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Lock

from tqdm import tqdm

from benchmarks.fuzzing import bags, checkpoints, documents, models, records, scans
from benchmarks.fuzzing.reader import Reader
from benchmarks.fuzzing.worker import REFUSED, RIGHT, Outcome, Worker

# Inputs that a worker takes at once.
PORTION = 200


@dataclass
class Verdicts:
    """The outcomes of one reader.

    Attributes:
        counts: How many of each kind; findings are one kind.
        peak: Most memory, MB.
    """

    counts: Counter[str] = field(default_factory=Counter)
    peak: int = 0

    def add(self, outcome: Outcome) -> None:
        """Counts an input."""
        self.counts["findings" if outcome.is_finding else outcome.verdict] += 1
        self.peak = max(self.peak, outcome.peak)


def all_readers(models_folder: Path) -> dict[str, Reader]:
    """Every reader by its name.

    Args:
        models_folder: Holds undamaged models and checkpoints.
    """
    found = [
        *scans.readers(),
        *documents.readers(),
        *records.readers(),
        *bags.readers(),
        *models.readers(models_folder),
        *checkpoints.readers(),
    ]
    return {reader.name: reader for reader in found}


def main(words: list[str] | None = None) -> int:
    """Runs the fuzzer.

    Args:
        words: Command line without the program's name; by default that of the process.

    Returns:
        Exit code: 1 where there are findings.
    """
    arguments = _parser().parse_args(words)
    if arguments.replay:
        return _replay(arguments.replay)
    with tempfile.TemporaryDirectory() as scratch:
        folder = arguments.models
        if folder is None:
            folder = Path(scratch) / "models"
            folder.mkdir()
            models.write_models(folder)
        verdicts = _fuzz(arguments, folder, Path(scratch))
    _print_table(verdicts)
    return 1 if any(each.counts["findings"] for each in verdicts.values()) else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--inputs", type=int, default=10_000, help="of all readers together")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1, help="processes at work")
    parser.add_argument("--readers", nargs="+", help="names of readers (default: all)")
    parser.add_argument(
        "--models", type=Path, help="folder of .onnx and .ckpt to damage (default: made anew)"
    )
    parser.add_argument("--out", type=Path, default=Path("runs/fuzz"), help="takes the findings")
    parser.add_argument("--replay", type=Path, metavar="FINDING", help="reads one finding again")
    return parser


def _fuzz(arguments: argparse.Namespace, models_folder: Path, scratch: Path) -> dict[str, Verdicts]:
    readers = partial(all_readers, models_folder)
    names = arguments.readers or list(readers())
    portions: SimpleQueue[tuple[str, range]] = SimpleQueue()
    each = -(-arguments.inputs // len(names))
    for name in names:
        for first in range(0, each, PORTION):
            portions.put((name, range(first, min(first + PORTION, each))))
    verdicts: dict[str, Verdicts] = defaultdict(Verdicts)
    counting = Lock()
    with tqdm(total=each * len(names), unit="input", disable=None) as progress:

        def work(number: int) -> None:
            folder = scratch / str(number)
            folder.mkdir()
            worker = Worker(arguments.seed, folder, readers)
            try:
                for name, outcome in _judged(worker, portions):
                    with counting:
                        verdicts[name].add(outcome)
                        progress.update()
                    if outcome.is_finding:
                        _keep(name, outcome, folder, arguments)
            finally:
                worker.end()

        with ThreadPoolExecutor(arguments.workers) as pool:
            list(pool.map(work, range(arguments.workers)))
    return {name: verdicts[name] for name in names}


def _judged(
    worker: Worker, portions: "SimpleQueue[tuple[str, range]]"
) -> Iterator[tuple[str, Outcome]]:
    while True:
        try:
            name, numbers = portions.get_nowait()
        except Empty:
            return
        for outcome in worker.judge(name, numbers):
            yield name, outcome


def _keep(name: str, outcome: Outcome, folder: Path, arguments: argparse.Namespace) -> None:
    """Copies what was read, so that it can be read again."""
    tqdm.write(f"{name}:{outcome.number} {outcome.verdict}", sys.stdout)
    kept = arguments.out / f"{name}-{arguments.seed}-{outcome.number}"
    shutil.rmtree(kept, ignore_errors=True)
    kept.mkdir(parents=True)
    for file in (folder / name).iterdir():
        if file.is_file():
            shutil.copy(file, kept)


def _replay(finding: Path) -> int:
    """Reads a finding in this process, which shows the whole error."""
    name = finding.name.rsplit("-", 2)[0]
    with tempfile.TemporaryDirectory() as scratch:
        copy = shutil.copytree(finding, Path(scratch) / "finding")
        models.write_models(Path(scratch))
        reader = all_readers(Path(scratch))[name]
        reader.read(copy / reader.file)
    print(RIGHT)
    return 0


def _print_table(verdicts: dict[str, Verdicts]) -> None:
    print(f"{'reader':<12}{'inputs':>9}{'right':>9}{'refused':>9}{'findings':>9}{'peak MB':>9}")
    total = Verdicts()
    for name, of_reader in [*verdicts.items(), ("total", total)]:
        counts = [of_reader.counts[kind] for kind in (RIGHT, REFUSED, "findings")]
        print(f"{name:<12}" + "".join(f"{n:>9,}" for n in (sum(counts), *counts, of_reader.peak)))
        total.counts.update(of_reader.counts)
        total.peak = max(total.peak, of_reader.peak)


if __name__ == "__main__":
    sys.exit(main())
