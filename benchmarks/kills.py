"""Kills commands of derain at random moments, and checks the files that they leave.

    python -m benchmarks.kills --kills 40 --seed 0
    python -m benchmarks.kills --kills 3 --commands run fuse view

Each command is killed by SIGKILL, one time in four by SIGTERM, at a moment drawn from its own
undisturbed duration; every other time where it was finished before. Then

- every file under its final name must be whole: read by derain's own readers or, where a format
  does not hold its length, as long as undisturbed;
- no process of it may be left, ten seconds later;
- after SIGTERM it may leave no temporary file, and it must exit with 143;
- the same command must succeed in the same place.

Ends with a table, and with 1 where anything fell short. Linux only.
"""

import argparse
import json
import random
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import yaml
from PIL import Image
from tqdm import tqdm

from benchmarks.processes import DERAIN, end_session, started
from benchmarks.small_inputs import COMMANDS, SmallInputs
from derain.bags.bag import Bag
from derain.cli.signals import interrupting
from derain.evaluation.text_tables import markdown_table
from derain.export.runtime import Derainer
from derain.files import read_scan
from derain.jobs.job import FOLDER as RECORDS
from derain.models.checkpoint import load_model

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
        counts: Its outcome, by column of the table.
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
    process = run_in(folder, arguments)
    if ended(process):
        raise RuntimeError(f"fails undisturbed: {printed(folder)}")
    return Victim(arguments, folder, time.monotonic() - begun)


def kill_once(victim: Victim, generator: random.Random, folder: Path, again: bool) -> list[str]:
    """Kills a command once, counts the outcome, and returns the faults.

    Args:
        victim: The command.
        generator: Where moment and signal come from.
        folder: An empty folder to run it in.
        again: True if it was finished there before.
    """
    if again:
        shutil.copytree(victim.folder / "out", folder / "out")
    by = generator.choice([signal.SIGKILL] * 3 + [signal.SIGTERM])
    process = run_in(folder, victim.arguments)
    try:
        ended(process, within=generator.uniform(0, victim.seconds))
    except subprocess.TimeoutExpired:
        process.send_signal(by)
    code, counts = ended(process), Counter(kills=1)
    orphans = end_session(process.pid, NOTICE)
    counts["finished first"] = int(code == 0)
    # Python is not listening yet in its first moments.
    counts["wrong exit"] = int(code not in (0, -by, 128 + by))
    counts["left running"] = len(orphans)
    counts[f"left by {by.name}"] = len(temporary_files(victim, folder)) if code else 0
    faults = [f"exit {code} after {by.name}: {printed(folder)}"] if counts["wrong exit"] else []
    faults += [f"left running: {orphan}" for orphan in orphans]
    cut = half_written(victim, folder, complete=False)
    counts["half-written"] = len(cut)
    faults += [f"half-written: {fault}" for fault in cut]
    if by == signal.SIGTERM:
        faults += [f"left by SIGTERM: {file}" for file in temporary_files(victim, folder)]
    failed = [printed(folder)] if ended(run_in(folder, victim.arguments)) else []
    failed += half_written(victim, folder, complete=True)
    counts["failed again"] = int(bool(failed))
    counts["left after the next run"] = len(temporary_files(victim, folder))
    victim.counts += counts
    return [*faults, *(f"again: {fault}" for fault in failed)]


def run_in(folder: Path, arguments: Sequence[str | Path]) -> subprocess.Popen[bytes]:
    """Starts a command of derain in a folder of its own, its temporary files included."""
    (folder / "out").mkdir(parents=True, exist_ok=True)
    (folder / "tmp").mkdir(exist_ok=True)
    with (folder / "printed").open("wb") as output:
        return started(
            [DERAIN, *arguments],
            cwd=folder,
            env={"TMPDIR": str(folder / "tmp")},
            stdout=output,
            stderr=subprocess.STDOUT,
        )


def ended(process: subprocess.Popen[bytes], within: float | None = None) -> int:
    """Exit code of a command, waited for; it does not outlive this program."""
    try:
        return process.wait(within)
    except KeyboardInterrupt:
        process.kill()
        raise


def printed(folder: Path) -> str:
    """The end of what the last command in a folder printed."""
    return (folder / "printed").read_text(errors="replace")[-500:].strip()


def temporary_files(victim: Victim, folder: Path) -> list[Path]:
    """Files that are no result, and that an undisturbed command does not leave."""
    hidden = [
        path
        for path in (folder / "out").rglob(".*")
        if path.parent.name[0] != "." and path.name != RECORDS
    ]
    usual = {path.name for path in (victim.folder / "tmp").iterdir()}
    return [*hidden, *(path for path in (folder / "tmp").iterdir() if path.name not in usual)]


def half_written(victim: Victim, folder: Path, complete: bool) -> list[str]:
    """The faults of files under their final names and, if all should be there, missing files."""
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


def fault_of(file: Path, size: int | None) -> str | None:
    """The fault of a file; None if it is whole, or is one that its writer only adds to.

    Args:
        file: The file.
        size: Its length undisturbed, in bytes, where that is known.
    """
    if file.suffix in _READERS:
        try:
            _READERS[file.suffix](file)
        except Exception as error:
            return f"{type(error).__name__}: {error}"
    elif file.suffix in (".bin", ".label") and size not in (None, file.stat().st_size):
        return f"{file.stat().st_size} bytes, not {size}"
    return None


def _lines(file: Path) -> None:
    assert file.read_text("utf-8").endswith("\n"), "the last line is cut"


def _yaml(file: Path) -> None:
    assert yaml.safe_load(file.read_text("utf-8")) is not None, "empty"


def _picture(file: Path) -> None:
    with Image.open(file) as image:
        image.load()


def _bag(file: Path) -> None:
    assert sum(1 for _ in Bag(file).messages()), "no messages"


def _database(file: Path) -> None:
    with sqlite3.connect(file) as database:
        assert database.execute("PRAGMA integrity_check").fetchall() == [("ok",)]


_READERS: dict[str, Callable[[Path], object]] = {
    ".bag": _bag,
    ".ckpt": load_model,
    ".csv": _lines,
    ".db": _database,
    ".db3": _bag,
    ".json": lambda file: json.loads(file.read_text("utf-8")),
    ".mcap": _bag,
    ".md": _lines,
    ".npz": read_scan,
    ".onnx": Derainer,
    ".png": _picture,
    ".yaml": _yaml,
}


if __name__ == "__main__":
    sys.exit(main())
