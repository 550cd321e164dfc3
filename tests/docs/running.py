"""How the commands of a page are run."""

import io
import os
import subprocess
import sys
import tomllib
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

from derain.cli.main import TRAINING, main

# What the test adds to every training of a page: it shows no progress and draws nothing.
QUIETLY = ("--trainer.accelerator", "cpu", "--trainer.enable_progress_bar", "false")
NOTHING_DRAWN = ("--panels.scans", "0")
TIMED_ONCE = ("--scan", "scan.bin", "--repeats", "1")

COMMAND = "import sys; from derain.cli.main import main; sys.exit(main(sys.argv[1:]))"


def run(words: list[str], line: str, folder: Path) -> tuple[int, str]:
    """Runs a command in a page's folder, derain's in this process where that does.

    Args:
        words: The command's words, with what the test adds.
        line: The command as the page has it.
        folder: The page's, which is the current one.

    Returns:
        Its exit code and all that it printed.
    """
    if words[0] == "python":  # this one, whatever is first on the path
        return _finished([sys.executable, *words[1:]], {})
    if words[0] != "derain":
        return _finished(["bash", "-c", line], {})
    arguments = words[1:]
    if arguments[0] in TRAINING:
        arguments += [*QUIETLY, *NOTHING_DRAWN]
    elif arguments[0] == "export":
        arguments += TIMED_ONCE
    # Of what a page installs, `run` alone names members; another process finds their entry points.
    if arguments[0] == "run" and (folder / "pyproject.toml").exists():
        packages = install(folder)
        command = [sys.executable, "-c", COMMAND, *arguments]
        return _finished(command, {"PYTHONPATH": f"{folder}{os.pathsep}{packages}"})
    out = io.StringIO()
    with redirect_stdout(out), redirect_stderr(out):
        try:
            code = main(arguments)
        except SystemExit as leaving:  # argparse's way out
            code = leaving.code if isinstance(leaving.code, int) else 0
    return code, out.getvalue()


def install(folder: Path) -> Path:
    """Writes the entry points of a page's own package, as an installation would; returns where."""
    project = tomllib.loads((folder / "pyproject.toml").read_text("utf-8"))["project"]
    packages = folder / "installed"
    about = packages / f"{project['name']}-{project['version']}.dist-info"
    about.mkdir(parents=True, exist_ok=True)
    (about / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    )
    groups = project["entry-points"].items()
    lines = [
        line
        for group, members in groups
        for line in (f"[{group}]", *(f"{name} = {module}" for name, module in members.items()))
    ]
    (about / "entry_points.txt").write_text("\n".join(lines) + "\n")
    return packages


def _finished(command: list[str], environment: dict[str, str]) -> tuple[int, str]:
    finished = subprocess.run(
        command,
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    return finished.returncode, finished.stdout
