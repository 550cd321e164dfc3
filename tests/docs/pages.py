"""The snippets of a Markdown page or notebook, and its notes on how they are run."""

import json
import re
import shlex
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

REPOSITORY = Path(__file__).resolve().parents[2]
DOCS = REPOSITORY / "docs"
PAGES = [REPOSITORY / "README.md", *sorted(DOCS.rglob("*.md")), *sorted(DOCS.rglob("*.ipynb"))]

# A fenced block, with the comments right above it.
BLOCK = re.compile(
    r"^(?P<comments>(?:<!--.*?-->\n\n?)*)```(?P<language>\w+)(?P<options>[^\n]*)\n(?P<code>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
COMMENT = re.compile(r"<!--\s*(.*?)\s*-->", re.DOTALL)
NOT_RUN = re.compile(r"not run: (.+)", re.DOTALL)
EXIT_CODE = re.compile(r"exit code: (\d+)")
IN_THE_TEST = re.compile(r"in the test(?: of (\S+))?: (.+)", re.DOTALL)
TITLE = re.compile(r'title="([^"]+)"')
INCLUDED = re.compile(r'^--8<-- "([^"]+)"$', re.MULTILINE)


@dataclass(frozen=True)
class Snippet:
    """A fenced block of a page.

    Attributes:
        page: The page, as a path in the repository.
        line: Where the block begins, from 1; in a notebook, the number of the cell.
        language: What it is marked as.
        code: What stands in it.
        title: The file that it shows; empty where it shows none.
        not_run: Why it is not run; empty where it is.
        exit_code: What its commands end with.
        added: Options that the test adds to derain's commands, by command; of all by an empty name.
        printed: What a notebook holds of the cell's output; None for a page.
    """

    page: str
    line: int
    language: str
    code: str
    title: str = ""
    not_run: str = ""
    exit_code: int = 0
    added: dict[str, list[str]] = field(default_factory=dict)
    printed: str | None = None

    @property
    def place(self) -> str:
        """Where it stands."""
        return f"{self.page}:{self.line}"

    @property
    def commands(self) -> list[str]:
        """The command lines of a block of shell, each with those that it goes on in."""
        lines = self.code.replace("\\\n", " ").splitlines()
        if self.language == "console":
            lines = [line[2:] for line in lines if line.startswith("$ ")]
        return [line.strip() for line in lines if line.strip() and not line.startswith("#")]

    @property
    def outputs(self) -> list[str]:
        """What each command of a console's block prints."""
        parts = re.split(r"^\$ .*\n(?:(?<=\\\n).*\n)*", self.code, flags=re.MULTILINE)
        return parts[1:]

    def arguments(self, command: str) -> list[str]:
        """The words of a command, and what the test adds to those of derain."""
        words = shlex.split(command, comments=True)
        if words[:1] != ["derain"] or len(words) < 2:
            return words
        return [*words, *self.added.get("", []), *self.added.get(words[1], [])]


def snippets(page: Path) -> list[Snippet]:
    """The fenced blocks of a page, or the cells of code of a notebook, in order."""
    text = page.read_text("utf-8")
    name = page.relative_to(REPOSITORY).as_posix()
    if page.suffix == ".ipynb":
        cells = enumerate(json.loads(text)["cells"], start=1)
        return [_cell(name, number, cell) for number, cell in cells if cell["cell_type"] == "code"]
    return [_snippet(name, text, block) for block in BLOCK.finditer(text)]


def _cell(page: str, number: int, cell: dict[str, Any]) -> Snippet:
    printed = [line for output in cell["outputs"] for line in output.get("text", [])]
    return Snippet(page, number, "python", "".join(cell["source"]), printed="".join(printed))


def _snippet(page: str, text: str, block: re.Match[str]) -> Snippet:
    comments = COMMENT.findall(block["comments"])
    reasons = [found[1] for comment in comments if (found := NOT_RUN.match(comment))]
    codes = [int(found[1]) for comment in comments if (found := EXIT_CODE.match(comment))]
    added = [found for comment in comments if (found := IN_THE_TEST.match(comment))]
    title = TITLE.search(block["options"])
    return Snippet(
        page=page,
        line=text.count("\n", 0, block.start("language")) + 1,
        language=block["language"],
        code=INCLUDED.sub(lambda found: (REPOSITORY / found[1]).read_text("utf-8"), block["code"]),
        title=title[1] if title else "",
        not_run=" ".join(reasons),
        exit_code=codes[0] if codes else 0,
        added={found[1] or "": shlex.split(found[2]) for found in added},
    )
