"""Cleans a source by every executor, compares the bytes, and kills processes at random.

    python -m benchmarks.fleet drive/ --method default --block 4
    python -m benchmarks.fleet world/ --method default --kills 30 --seed 0

The ways are one process, two workers of one thread, four shards one after the other, and a Dask
scheduler with three workers. Prints seconds of each, with those in which a cluster starts, and
whether its results are those of one process, byte for byte.

With `--kills`, it kills a worker, the Dask scheduler, the client, or a shard at a random moment
after the first unit is done, and runs the same again until it succeeds. Then the bytes must be the
same, each unit must have one record, and nothing half-written may lie about. Ends with 1 where
anything fell short. Linux only.
"""

import argparse
import hashlib
import json
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path

from benchmarks.processes import DERAIN, end_session, of_session, started
from derain.evaluation.text_tables import markdown_table

ADDRESS = "tcp://127.0.0.1:8797"
SHARDS, DASK_WORKERS = 4, 3

# A command that is killed is run again at most so often; a client may well need to see first that
# its scheduler is gone.
MOST_RUNS = 5

# Seconds that the other processes of a session may take to notice that one is gone.
NOTICE = 4


@dataclass(frozen=True)
class Run:
    """The source to clean, and the options.

    Attributes:
        source: The scans.
        method: The method.
        options: Further options of ``derain run``.
        root: Where results go.
    """

    source: Sequence[Path]
    method: str
    options: Sequence[str]
    root: Path

    def command(self, out: Path, *options: str) -> list[str]:
        """The command line."""
        named = [DERAIN, "run", self.method, *self.source, "--out", out, *self.options, *options]
        return list(map(str, named))


def quietly(command: Sequence[str]) -> subprocess.Popen[bytes]:
    """Starts a command that prints nothing."""
    return started(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


@contextmanager
def cluster(folder: Path) -> Iterator[list[subprocess.Popen[bytes]]]:
    """Lends a Dask scheduler, then its workers."""
    dask = str(DERAIN.with_name("dask"))
    port = ADDRESS.rpartition(":")[2]
    processes = [quietly([dask, "scheduler", "--port", port, "--no-dashboard"])]
    for number in range(DASK_WORKERS):
        place = str(folder / f"dask {number}")
        options = ["--nthreads", "1", "--no-dashboard", "--local-directory", place]
        processes.append(quietly([dask, "worker", ADDRESS, *options]))
    while True:
        with suppress(OSError):
            socket.create_connection(("127.0.0.1", int(port)), 1).close()
            break
        time.sleep(0.1)
    try:
        yield processes
    finally:
        for process in processes:
            process.kill()
            process.wait()
            end_session(process.pid, NOTICE)


def one_process(run: Run, out: Path) -> None:
    """Cleans in one process, with every thread."""
    subprocess.run(run.command(out, "--workers", "1"), check=True, capture_output=True)


def two_workers(run: Run, out: Path) -> None:
    """Cleans by two processes."""
    subprocess.run(run.command(out, "--workers", "2"), check=True, capture_output=True)


def four_shards(run: Run, out: Path) -> None:
    """Cleans in four shards, one after the other."""
    for number in range(SHARDS):
        shard = f"{number}/{SHARDS}"
        subprocess.run(run.command(out, "--shard", shard), check=True, capture_output=True)


def dask(run: Run, out: Path) -> None:
    """Cleans by three workers of a Dask cluster."""
    with cluster(run.root):
        subprocess.run(run.command(out, "--dask", ADDRESS), check=True, capture_output=True)


OF_DASK = ("a worker of Dask", "the scheduler", "the client of Dask")
VICTIMS = ("a worker", "the client", "a shard", *OF_DASK)

# In which way each of them works, and is run again.
WAY_OF = {
    "a worker": "two workers",
    "the client": "two workers",
    "a shard": "four shards",
    **dict.fromkeys(OF_DASK, "Dask, three workers"),
}

WAYS: dict[str, Callable[[Run, Path], None]] = {
    "one process": one_process,
    "two workers": two_workers,
    "four shards": four_shards,
    "Dask, three workers": dask,
}


def main() -> int:
    """Compares, kills and prints."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("source", nargs="+", type=Path)
    parser.add_argument("--method", default="default")
    parser.add_argument("--block", type=int, default=50)
    parser.add_argument("--alone", action="store_true")
    parser.add_argument("--kills", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        options = ["--block", str(arguments.block), "--most-removed", "1"]
        options += ["--alone"] if arguments.alone else []
        source = [path.absolute() for path in arguments.source]
        run = Run(source, arguments.method, options, Path(name))
        seconds, sums = compared(run)
        wanted = sums["one process"]
        rows = [
            [way, f"{seconds[way]:.1f}", "the same" if sums[way] == wanted else "OTHER"]
            for way in WAYS
        ]
        print(markdown_table(("way", "seconds", "bytes"), rows), flush=True)
        faults = len(set(sums.values())) - 1
        if arguments.kills:
            faults += kill_again_and_again(run, arguments.kills, arguments.seed, seconds, wanted)
    return int(faults > 0)


def compared(run: Run) -> tuple[dict[str, float], dict[str, str]]:
    """Seconds of each way, and the checksum of its results."""
    seconds, sums = {}, {}
    for way in WAYS:
        out = run.root / way
        begun = time.monotonic()
        WAYS[way](run, out)
        seconds[way], sums[way] = time.monotonic() - begun, checksum(out)
    return seconds, sums


def kill_again_and_again(
    run: Run, kills: int, seed: int, seconds: dict[str, float], wanted: str
) -> int:
    """Kills one victim after the other, prints a table, and returns how much fell short."""
    generator, faults = random.Random(seed), 0
    killed, too_late, runs = Counter[str](), Counter[str](), Counter[str]()
    for number in range(kills):
        victim, out = VICTIMS[number % len(VICTIMS)], run.root / f"kill {number}"
        killed[victim] += 1
        too_late[victim] += not kill_once(run, victim, out, seconds, generator)
        while runs[victim] < MOST_RUNS * killed[victim]:
            runs[victim] += 1
            try:
                WAYS[WAY_OF[victim]](run, out)
            except subprocess.CalledProcessError:
                continue
            break
        for fault in short_of(out, wanted):
            faults += 1
            print(f"kill {number}, {victim}: {fault}", file=sys.stderr, flush=True)
        shutil.rmtree(out)
    rows = [[each, *(str(count[each]) for count in (killed, too_late, runs))] for each in killed]
    print(markdown_table(("killed", "times", "of them too late", "runs until done"), rows))
    print(f"{faults} fell short")
    return faults


def kill_once(
    run: Run, victim: str, out: Path, seconds: dict[str, float], generator: random.Random
) -> bool:
    """Kills a victim at a random moment after the first unit is done; whether it was in time."""
    options = {"two workers": ["--workers", "2"], "four shards": ["--shard", f"1/{SHARDS}"]}
    with cluster(run.root) if victim in OF_DASK else nullcontext([]) as processes:
        client = quietly(run.command(out, *options.get(WAY_OF[victim], ["--dask", ADDRESS])))
        while client.poll() is None and not any((out / ".derain/units").rglob("*.json")):
            time.sleep(0.05)
        time.sleep(generator.uniform(0, seconds[WAY_OF[victim]] / 4))
        in_time = client.poll() is None
        if victim == "the scheduler":
            processes[0].kill()
        elif victim == "a worker of Dask":
            processes[generator.randrange(1, len(processes))].kill()
        elif victim == "a worker":
            if others := sorted(set(of_session(client.pid)) - {client.pid}):
                os.kill(generator.choice(others), signal.SIGKILL)
        else:
            client.kill()
        try:
            client.wait(3 * seconds[WAY_OF[victim]] + 60)
        except subprocess.TimeoutExpired:
            client.kill()
            raise
        end_session(client.pid, NOTICE)
    return in_time


def short_of(out: Path, wanted: str) -> Iterator[str]:
    """The faults of results that should be complete."""
    if checksum(out) != wanted:
        yield "its results are others than those of one process"
    units = [unit for unit, *_ in json.loads((out / ".derain/units.json").read_bytes())]
    records = (out / ".derain/units").rglob("*.json")
    found = Counter(json.loads(record.read_bytes())["unit"] for record in records)
    if found != Counter(units):
        odd = sorted((found - Counter(units)) + (Counter(units) - found))
        yield f"units without one record each: {odd[:5]}"
    if left := [path for path in out.rglob(".derain-*") if path.exists()]:
        yield f"left lying about: {left[0]}"


def checksum(out: Path) -> str:
    """Of all results by their paths, without records."""
    digest = hashlib.sha256()
    for path in sorted(out.rglob("*")):
        if path.is_file() and ".derain" not in path.parts:
            digest.update(str(path.relative_to(out)).encode() + path.read_bytes())
    return digest.hexdigest()


if __name__ == "__main__":
    sys.exit(main())
