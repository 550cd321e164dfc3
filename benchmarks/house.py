"""Measures the code base: lines by folder, modules, the imports of a command, and its calls.

    python -m benchmarks.house --scan WADS/sample.bin > house.md

Code lines are those without docstrings, comments and blank lines.
"""

import argparse
import ast
import io
import subprocess
import sys
import tempfile
import time
import tokenize
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PRODUCT = ("derain", "models", "datamodules", "export", "configs")
OTHERS = ("benchmarks", "release", "examples", "tests")
SHORT_MODULE = 25
STARTS = 7

NO_CODE = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
}

# Follows a command, and prints what of derain it enters, and the calls that lead to the labels.
FOLLOW = """
import sys
import derain
from derain.cli import run  # imported beforehand, so that only the run itself is followed
from derain.cli.main import main
from derain.files import labels

root, entered, ways = sys.argv[1], set(), []

def is_ours(name):
    return name.startswith(root) and "site-packages" not in name

def follow(frame, event, _):
    code = frame.f_code
    if event != "call" or not is_ours(code.co_filename):
        return
    entered.add((code.co_filename, code.co_qualname))
    if code is labels.write_labels.__code__:
        way = []
        while frame is not None:
            way.append(frame.f_code.co_filename)
            frame = frame.f_back
        ways.append([name for name in way if is_ours(name)])

sys.setprofile(follow)
main(sys.argv[2:])
sys.setprofile(None)
print(
    f"{len(ways[0])} calls over {len(set(ways[0]))} files lead to the written mask; "
    f"{len({name for name, _ in entered})} files and {len(entered)} functions are entered"
)
"""

VERSION = "import sys; from derain.cli.main import main; main(['--version'])"
LOADED = """
import sys
from derain.cli.main import main
try:
    main(['--version'])
except SystemExit:
    print(len(sys.modules), sum(name.partition('.')[0] == 'derain' for name in sys.modules))
"""


@dataclass(frozen=True)
class Module:
    """A Python file: its path from the root, its lines of code, and which modules it imports."""

    path: Path
    lines: int
    imports: tuple[str, ...]
    import_lines: int

    @property
    def room(self) -> str:
        """The folder that it lies in, two levels deep."""
        return "/".join(self.path.parts[:-1][:2])

    @property
    def name(self) -> str:
        """The name under which others import it."""
        inside = self.path.with_suffix("").parts
        inside = inside if inside[0] == "derain" else ("derain", *inside)
        return ".".join(inside).removesuffix(".__init__")


def main() -> None:
    """Prints the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scan", type=Path, required=True, help="a scan for `derain run dror`")
    arguments = parser.parse_args()

    product = list(_modules(*PRODUCT))
    named = [module for module in product if module.path.name != "__init__.py"]
    rooms = Counter[str]()
    for module in product:
        rooms[module.room] += module.lines
    print("| room | lines |\n|---|---:|")
    for room, lines in rooms.most_common():
        print(f"| {room} | {lines:,} |")
    print(
        f"| product | {rooms.total():,} |\n\n"
        f"of these lines {sum(module.import_lines for module in product):,} are imports; "
        f"{len(named)} modules, {sum(module.lines <= SHORT_MODULE for module in named)} of "
        f"{SHORT_MODULE} lines or fewer, {_with_one_importer(named, product)} with one importer"
    )
    for folder in OTHERS:
        modules = list(_modules(folder))
        print(f"{folder}: {sum(module.lines for module in modules):,} lines, {len(modules)} files")
    print(f"`derain --version`: {_modules_of_start()}, {_seconds_of_start():.2f} s")
    print(f"`derain run dror`: {_way_of(arguments.scan)}")


def _modules(*folders: str) -> Iterator[Module]:
    for folder in folders:
        for path in sorted((ROOT / folder).rglob("*.py")):
            text = path.read_text("utf-8")
            tree = ast.parse(text)
            imports = [
                node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)
            ]
            yield Module(
                path.relative_to(ROOT),
                len(_lines_with_tokens(text) - _docstring_lines(tree)),
                tuple(name for node in imports for name in _names(node)),
                sum(len(_span(node)) for node in imports),
            )


def _lines_with_tokens(text: str) -> set[int]:
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return {
        line
        for token in tokens
        if token.type not in NO_CODE
        for line in range(token.start[0], token.end[0] + 1)
    }


def _docstring_lines(tree: ast.Module) -> set[int]:
    return {
        line
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
        for line in _span(node)
    }


def _span(node: ast.stmt) -> range:
    return range(node.lineno, (node.end_lineno or node.lineno) + 1)


def _names(node: ast.Import | ast.ImportFrom) -> list[str]:
    """Modules that a statement may import."""
    names = [alias.name for alias in node.names]
    if isinstance(node, ast.Import):
        return names
    return [str(node.module), *(f"{node.module}.{name}" for name in names)]


def _with_one_importer(modules: list[Module], importing: list[Module]) -> int:
    importers = Counter(name for module in importing for name in set(module.imports))
    return sum(importers[module.name] == 1 for module in modules)


def _modules_of_start() -> str:
    every, ours = _output("-c", LOADED).splitlines()[-1].split()
    return f"{every} modules, {ours} of derain"


def _seconds_of_start() -> float:
    """Seconds of `derain --version`, the least of several."""
    seconds = []
    for _ in range(STARTS):
        start = time.perf_counter()
        _output("-c", VERSION)
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def _way_of(scan: Path) -> str:
    with tempfile.TemporaryDirectory() as out:
        command = ["run", "dror", str(scan), "--out", out]
        return _output("-c", FOLLOW, str(ROOT), *command).splitlines()[-1]


def _output(*arguments: str) -> str:
    command = [sys.executable, *arguments]
    return subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout


if __name__ == "__main__":
    main()
