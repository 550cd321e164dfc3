"""Every command and snippet of README.md, and of the documentation's pages and notebook, is run."""

import io
import re
import sys
from collections.abc import Iterator
from contextlib import redirect_stdout
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
import torch
import yaml

import derain
from derain.cli import main as command_line
from derain.models.registry import NETWORKS

from .pages import PAGES, REPOSITORY, Snippet, snippets
from .prepared import prepare, put_weights, write_drive
from .running import run

SHELL = ("bash", "console")

# What is shown and not run: parts of programs of other languages, trees of files, formulas.
SHOWN = ("text", "cpp", "toml", "json")

BY_PAGE = {page: snippets(page) for page in PAGES}

# Those with the most commands first: what takes long is not left to the end.
WITH_SNIPPETS = sorted(
    (page for page, blocks in BY_PAGE.items() if blocks),
    key=lambda page: -sum(len(block.commands) for block in BY_PAGE[page]),
)
NOT_RUN = [block for blocks in BY_PAGE.values() for block in blocks if block.not_run]

# Times, counts and checksums are of one machine.
NUMBER = re.compile(r"\b[\da-f]{12}\b|\d[\d,.]*")

# What pages call the folder that their commands run in.
YOUR_FOLDER = "/home/you"


def name_of(page: Path) -> str:
    return page.relative_to(REPOSITORY).as_posix()


@pytest.fixture
def page_folder(tmp_path, made_once, random_outdet, monkeypatch) -> Iterator[Path]:
    """The folder that a page is run in, in a process which proves and times little."""
    prepare(tmp_path, made_once("documented_drive", write_drive))
    put_weights(tmp_path, random_outdet)
    monkeypatch.chdir(tmp_path)
    # The page of troubles shows what is printed where this runtime is missing.
    monkeypatch.setitem(sys.modules, "openvino", None)
    # What a page adds is gone after it.
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(NETWORKS, "_members", dict(NETWORKS))
    with torch.random.fork_rng(devices=[]):
        yield tmp_path
    sys.modules.pop("toy_network", None)


@pytest.mark.usefixtures("one_block", "short_proof", "in_this_process")
@pytest.mark.parametrize("page", WITH_SNIPPETS, ids=name_of)
def test_a_page_runs_from_its_first_snippet_to_its_last(page, page_folder) -> None:
    namespace: dict[str, Any] = {}
    for snippet in BY_PAGE[page]:
        if not snippet.not_run:
            follow(snippet, page_folder, namespace)


def follow(snippet: Snippet, folder: Path, namespace: dict[str, Any]) -> None:
    """Runs what a snippet shows, and compares the output where the page asks for it."""
    if snippet.title:
        (folder / snippet.title).write_text(snippet.code, "utf-8")
    if snippet.language == "yaml":
        assert yaml.safe_load(snippet.code), snippet.place
    elif snippet.language == "python":
        code = compile(snippet.code, snippet.place, "exec")
        out = io.StringIO()
        with redirect_stdout(out):
            if not snippet.title:
                exec(code, namespace)
        if snippet.printed is not None:
            assert same(snippet.printed, out.getvalue()), f"{snippet.place}: {out.getvalue()}"
    elif snippet.language in SHELL:
        expected = snippet.outputs if snippet.language == "console" else []
        for number, line in enumerate(snippet.commands):
            code, printed = run(snippet.arguments(line), line, folder)
            assert code == snippet.exit_code, f"{snippet.place}: {line}\n{printed}"
            if expected:
                printed = printed.replace(str(folder), YOUR_FOLDER)
                assert same(expected[number], printed), f"{snippet.place}: {line}\n{printed}"
    else:
        assert snippet.language in SHOWN, f"{snippet.place}: {snippet.language}"


def same(expected: str, printed: str) -> bool:
    """Whether two outputs are the same but for numbers and white space."""
    return NUMBER.sub("0", expected).split() == NUMBER.sub("0", printed).split()


@pytest.mark.parametrize("snippet", NOT_RUN, ids=lambda snippet: snippet.place)
def test_what_is_not_run_has_a_reason_and_options_that_there_are(snippet) -> None:
    for line in snippet.commands:
        words = snippet.arguments(line)
        if words[0] == "derain":
            assert words[1] not in command_line.TRAINING, f"{snippet.place}: run it, shortened"
            command_line._parser(words[1]).parse_args(words[1:])
        elif words[:2] == ["python", "-m"]:
            assert find_spec(words[2]), f"{snippet.place}: no module {words[2]}"
    pytest.skip(f"not run: {snippet.not_run}")


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_commands_stand_in_fences(page) -> None:
    """Indented, they would be run by nobody."""
    text = re.sub(r"^```.*?^```$", "", page.read_text("utf-8"), flags=re.MULTILINE | re.DOTALL)
    assert not re.findall(r"^ {4}(?:derain|pip|python3?|make|tensorboard) .*", text, re.MULTILINE)


def test_every_page_stands_in_the_navigation_once() -> None:
    navigation = (REPOSITORY / "mkdocs.yml").read_text("utf-8")
    named = re.findall(r"^ +- .+: (\S+\.md)$", navigation, re.MULTILINE)
    pages = [page for page in PAGES[1:] if page.suffix == ".md"]
    assert sorted(named) == [page.relative_to(REPOSITORY / "docs").as_posix() for page in pages]


def test_every_name_that_derain_offers_stands_in_the_reference() -> None:
    pages = "".join(page.read_text("utf-8") for page in PAGES[1:])
    shown = {name.rsplit(".", 1)[-1] for name in re.findall(r"^::: ([\w.]+)$", pages, re.MULTILINE)}
    assert {name for name in derain.__all__ if name != "__version__"} <= shown
