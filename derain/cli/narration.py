"""Runs commands of derain one after another, with a line or two on the screen for each."""

import io
import re
import shlex
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path

from derain.files.atomic import refuse_unwritable

# Seconds between reports of how far a command has come: on a terminal (True), and in a file.
PERIODS = {True: 0.5, False: 15.0}

# How an error of derain's begins, and how a warning does.
OF_DERAIN = "derain: "
WARNING_OF_DERAIN = f"{OF_DERAIN}warning: "

# A progress bar of Lightning or tqdm: what is counted, and the share that is done.
_BAR = re.compile(r"(?P<what>[^|\r\n]*?):?\s*(?P<share>\d+%)?\|.*\|\s*\d+/")
_EPOCH = re.compile(r"Epoch (\d+)")  # as Lightning counts them, from 0
_MEASURING = re.compile(r"(Sanity Checking|Validation)( DataLoader \d+)?")
_MOVES_OF_CURSOR = re.compile(r"\x1b\[[A-Z]")


class Transcript(io.TextIOBase):
    """Stands in for the stream that a command prints to.

    Whole lines are kept and written to a file; from progress bars it reads how far the command has
    come. A logger that holds on to it may go on writing when the command is over.

    Args:
        log: The file.

    Attributes:
        said: The lines.
        progress: What the last progress bar counts, and the share done; empty without a bar.
        bar: The text of that bar.
    """

    def __init__(self, log: Path) -> None:
        self._log = log
        self._unfinished = ""
        self.said: list[str] = []
        self.progress = self.bar = ""

    def write(self, text: str) -> int:
        """Takes more text, which need not end with a line."""
        for part in _MOVES_OF_CURSOR.sub("", text).splitlines(keepends=True):
            self._unfinished += part
            if found := _BAR.search(self._unfinished):
                self.bar = self._unfinished.strip()
                self.progress = f"{found['what'].strip()} {found['share'] or ''}"
            if self._unfinished.endswith(("\n", "\r")):
                self._end_line(is_bar=found is not None)
        return len(text)

    def isatty(self) -> bool:
        """True: commands draw progress bars on terminals only, and the bars are wanted."""
        return True

    def _end_line(self, *, is_bar: bool) -> None:
        line, self._unfinished = self._unfinished.rstrip(), ""
        if line and not is_bar:
            self.said.append(line)
            with self._log.open("a", encoding="utf-8") as file:
                file.write(line + "\n")


class Narrator:
    """Runs commands, and prints each with its result and the time that it took.

    Args:
        run: Runs a command of derain, and returns its exit code.
        log: File that everything the commands print goes to.
        steps: How many commands there will be; 0 where that is not known.

    Attributes:
        log: That file.
        commands: The commands so far, as they are typed.
        failed: Whether the last command could not do all.
        warned: What the commands warned of, line by line, as far as derain's own.

    Raises:
        InputError: The file cannot be written.
    """

    def __init__(self, run: Callable[[list[str]], int], log: Path, steps: int = 0) -> None:
        self._run = run
        self.log = log
        self._steps = steps
        self.commands: list[str] = []
        self.failed = False
        self.warned: list[str] = []
        self._begun = time.monotonic()
        refuse_unwritable(log)
        log.write_text("", "utf-8")

    def step(
        self,
        *command: str,
        result: Callable[[Transcript], str],
        leaves: Path | None = None,
        epochs: int = 0,
    ) -> list[str]:
        """Runs one command.

        Args:
            command: Its arguments.
            result: Makes the line that is printed as its result, of what it printed itself.
            leaves: What it leaves where it could not do all, but what could be done; None
                where there is no such thing.
            epochs: How many epochs it trains; 0 where that is not known.

        Returns:
            The lines that it printed.

        Raises:
            SystemExit: It failed, and the reason has been printed.
        """
        self.commands.append(f"derain {shlex.join(command)}")
        line = f"$ {self.commands[-1]}"
        print(line, flush=True)
        begun = time.monotonic()
        with self.log.open("a", encoding="utf-8") as file:
            file.write(f"\n{line}\n")
        printed, warned = Transcript(self.log), Transcript(self.log)

        def progress() -> str:
            place = f"step {len(self.commands)} of {self._steps}" if self._steps else ""
            of_step = " ".join(filter(None, (printed.progress, warned.progress)))
            return ", ".join(filter(None, (place, _in_words(of_step, epochs)))) or "..."

        with (
            _told_how_far(progress, begun),
            redirect_stdout(printed),
            redirect_stderr(warned),
        ):
            code = self._run(list(command))
        self.failed = code != 0
        self.warned += [line for line in warned.said if line.startswith(OF_DERAIN)]
        if code and not (leaves and leaves.exists()):
            # A traceback, or what is printed last of anything else, has no such line.
            errors = [line for line in warned.said if _is_error(line)] or warned.said[-1:]
            print(*errors, f"All it said: {self.log}", sep="\n", file=sys.stderr)
            raise SystemExit(code)
        print(f"  {_clock(time.monotonic() - begun)}  {result(printed)}", flush=True)
        return printed.said

    @property
    def elapsed(self) -> str:
        """Time since the beginning."""
        return _clock(time.monotonic() - self._begun)


@contextmanager
def _told_how_far(progress: Callable[[], str], begun: float) -> Iterator[None]:
    """Shows how far a command has come: on one line of a terminal, or in a file, line by line."""
    out, done = sys.stdout, threading.Event()
    live = out.isatty()

    def tell() -> None:
        while not done.wait(PERIODS[live]):
            text = f"  {_clock(time.monotonic() - begun)}  {progress()}"
            if live:
                width = shutil.get_terminal_size().columns - 1
                out.write(f"\r\x1b[K{text[:width]}")
            else:
                out.write(f"{text}\n")
            out.flush()

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield
    finally:
        done.set()
        teller.join()
        if live:
            out.write("\r\x1b[K")
            out.flush()


def _in_words(progress: str, epochs: int) -> str:
    """The progress of a command, with an epoch counted from 1, of all where that is known."""
    of_all = f" of {epochs}" if epochs else ""
    progress = _EPOCH.sub(lambda found: f"epoch {int(found[1]) + 1}{of_all}", progress)
    return _MEASURING.sub("measuring", progress)


def _is_error(line: str) -> bool:
    """Whether a line says why a command failed, not only what it warns of."""
    return line.startswith(OF_DERAIN) and not line.startswith(WARNING_OF_DERAIN)


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"
