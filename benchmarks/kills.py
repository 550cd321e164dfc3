"""Kills commands of derain at random moments, and judges what they leave.

    python -m benchmarks.kills --kills 40 --seed 0
    python -m benchmarks.kills --kills 3 --commands run fuse view

Each command is killed by SIGKILL, one time in four by SIGTERM, at a moment drawn from its own
undisturbed duration; every other time where it was finished before. Then

- every file under its final name must be whole: read by derain's own readers or, where a format
  does not say how long it is, as long as undisturbed;
- no process of it may be left, ten seconds later;
- after SIGTERM it may leave no temporary file, and it must exit with 143;
- the same command must succeed in the same place.

Ends with a table, and with 1 where anything fell short. Linux only.
"""

import argparse
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from tqdm import tqdm

from benchmarks.installed import DERAIN
from benchmarks.small_inputs import COMMANDS, SmallInputs
from benchmarks.whole_files import fault_of
from derain.cli.signals import interrupting
from derain.evaluation.text_tables import markdown_table
from derain.jobs.job import FOLDER as RECORDS

# Seconds that what a command began may take to notice that it is gone: a data loader of torch's
# looks every five.
NOTICE = 10

# What no one run makes twice under the same name.
OF_ONE_RUN = re.compile(r"version_\d+|events\.out\.tfevents\..*")

COLUMNS = (
    *("kills", "finished first", "half-written", "left running", "left by SIGTERM"),
    *("left by SIGKILL", "left after the next run", "wrong exit", "failed again"),
)
# What a killed process can do nothing about.
ALLOWED = {"kills", "finished first", "left by SIGKILL", "left after the next run"}


@dataclass
class Victim:
    """A command that is killed.

    Attributes:
        arguments: Of the command line.
        folder: Where it ran undisturbed.
        seconds: How long it takes undisturbed.
        counts: What became of it, by column of the table.
    """

    arguments: Sequence[str | Path]
    folder: Path
    seconds: float = 0.0
    counts: Counter[str] = field(default_factory=Counter)


def main() -> int:
    """Kills, judges and prints."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=40, help="over all commands (default: 40)")
    parser.add_argument("--seed", type=int, default=0, help="of moments and signals (default: 0)")
    parser.add_argument("--commands", nargs="+", choices=COMMANDS, default=list(COMMANDS))
    arguments = parser.parse_args()
    generator = random.Random(arguments.seed)
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        inputs, victims = SmallInputs(root / "inputs"), {}
        with suppress(KeyboardInterrupt), interrupting():  # the table is of the kills until then
            for number in tqdm(range(arguments.kills), unit="kill", disable=None):
                command = arguments.commands[number % len(arguments.commands)]
                if command not in victims:
                    victims[command] = undisturbed(COMMANDS[command](inputs), root / command)
                victim, again = victims[command], number // len(arguments.commands) % 2 == 1
                for fault in kill_once(victim, generator, root / f"kill {number}", again):
                    print(f"kill {number}, {command}: {fault}", file=sys.stderr, flush=True)
    total: Counter[str] = sum((victim.counts for victim in victims.values()), Counter())
    counted = {**{command: victim.counts for command, victim in victims.items()}, "all": total}
    rows = [[name, *(str(counts[c]) for c in COLUMNS)] for name, counts in counted.items()]
    print(markdown_table(("command", *COLUMNS), rows))
    return int(any(total[column] for column in COLUMNS if column not in ALLOWED))


def undisturbed(arguments: Sequence[str | Path], folder: Path) -> Victim:
    """Lets a command finish, and times it."""
    begun = time.monotonic()
    process = started(arguments, folder)
    if ended(process):
        raise RuntimeError(f"fails undisturbed: {said(folder)}")
    return Victim(arguments, folder, time.monotonic() - begun)


def kill_once(victim: Victim, generator: random.Random, folder: Path, again: bool) -> list[str]:
    """Kills a command once, counts what became of it, and tells what fell short.

    Args:
        victim: The command.
        generator: Where moment and signal come from.
        folder: An empty folder to run it in.
        again: Whether it was finished there before.
    """
    if again:
        shutil.copytree(victim.folder / "out", folder / "out")
    by = generator.choice([signal.SIGKILL] * 3 + [signal.SIGTERM])
    process = started(victim.arguments, folder)
    try:
        ended(process, within=generator.uniform(0, victim.seconds))
    except subprocess.TimeoutExpired:
        process.send_signal(by)
    code, counts = ended(process), Counter(kills=1)
    orphans = left_running(process.pid)
    counts["finished first"] = int(code == 0)
    # Python is not listening yet in its first moments.
    counts["wrong exit"] = int(code not in (0, -by, 128 + by))
    counts["left running"] = len(orphans)
    counts[f"left by {by.name}"] = len(temporary_files(victim, folder)) if code else 0
    faults = [f"exit {code} after {by.name}: {said(folder)}"] if counts["wrong exit"] else []
    faults += [f"left running: {orphan}" for orphan in orphans]
    cut = half_written(victim, folder, complete=False)
    counts["half-written"] = len(cut)
    faults += [f"half-written: {fault}" for fault in cut]
    if by == signal.SIGTERM:
        faults += [f"left by SIGTERM: {file}" for file in temporary_files(victim, folder)]
    failed = [said(folder)] if ended(started(victim.arguments, folder)) else []
    failed += half_written(victim, folder, complete=True)
    counts["failed again"] = int(bool(failed))
    counts["left after the next run"] = len(temporary_files(victim, folder))
    victim.counts += counts
    return [*faults, *(f"again: {fault}" for fault in failed)]


def started(arguments: Sequence[str | Path], folder: Path) -> subprocess.Popen[bytes]:
    """Starts a command in a session and a folder of its own, its temporary files included."""
    (folder / "out").mkdir(parents=True, exist_ok=True)
    (folder / "tmp").mkdir(exist_ok=True)
    with (folder / "said").open("wb") as output:
        return subprocess.Popen(
            [DERAIN, *arguments],
            cwd=folder,
            env={**os.environ, "TMPDIR": str(folder / "tmp"), "OMP_NUM_THREADS": "1"},
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )


def ended(process: subprocess.Popen[bytes], within: float | None = None) -> int:
    """Exit code of a command, waited for; it does not outlive this program."""
    try:
        return process.wait(within)
    except KeyboardInterrupt:
        process.kill()
        raise


def said(folder: Path) -> str:
    """The end of what the last command in a folder has said."""
    return (folder / "said").read_text(errors="replace")[-500:].strip()


def left_running(session: int) -> list[str]:
    """Command lines of what still runs of a session after a while; they are ended then."""
    give_up = time.monotonic() + NOTICE
    while (processes := _of_session(session)) and time.monotonic() < give_up:
        time.sleep(0.2)
    for process in processes:
        os.kill(process, signal.SIGKILL)
    return list(processes.values())


def _of_session(session: int) -> dict[int, str]:
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state, _, _, of = (folder / "stat").read_text().rpartition(") ")[2].split()[:4]
            if int(of) == session and state != "Z":
                found[int(folder.name)] = (folder / "cmdline").read_text().replace("\0", " ")
        except OSError:
            continue  # it ended meanwhile
    return found


def temporary_files(victim: Victim, folder: Path) -> list[Path]:
    """What lies about that is nobody's result, and that is not left undisturbed as well."""
    hidden = [
        path
        for path in (folder / "out").rglob(".*")
        if path.parent.name[0] != "." and path.name != RECORDS
    ]
    usual = {path.name for path in (victim.folder / "tmp").iterdir()}
    return [*hidden, *(path for path in (folder / "tmp").iterdir() if path.name not in usual)]


def half_written(victim: Victim, folder: Path, complete: bool) -> list[str]:
    """What is wrong with the files under their final names, or, if all should be there, missing."""
    expected, found = _by_name(victim.folder / "out"), _by_name(folder / "out")
    sizes = {name: file.stat().st_size for name, file in expected.items()}
    faults = [
        f"{name}: {fault}"
        for name, file in found.items()
        if (fault := fault_of(file, sizes.get(name))) is not None
    ]
    missing = [f"{name} is missing" for name in expected if complete and name not in found]
    return [*faults, *missing]


def _by_name(folder: Path) -> dict[str, Path]:
    """Files below a folder, but hidden ones, by what does not change between runs of their path."""
    paths = [path.relative_to(folder) for path in sorted(folder.rglob("*")) if path.is_file()]
    seen = [path for path in paths if not any(part[0] == "." for part in path.parts)]
    return {OF_ONE_RUN.sub("*", path.as_posix()): folder / path for path in seen}


if __name__ == "__main__":
    sys.exit(main())
