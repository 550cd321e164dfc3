"""Docstrings as Markdown: an extension of Griffe, which reads them for mkdocstrings.

derain's docstrings are Google's, with Sphinx's roles for the names of other things, and with a
paragraph ``Source:`` where something comes from elsewhere. Both are made Markdown here.
"""

import re
from typing import Any

from griffe import Docstring, Extension, Object

# :class:`~derain.scan.Scan`, with or without the tilde that shows the last part alone.
ROLE = re.compile(r":(?:class|func|meth|mod|attr|data):`~?([\w.]+)`")

# A paragraph that Griffe would take for a section of its own.
SOURCE = re.compile(r"^(Sources?): ", re.MULTILINE)

# Griffe knows examples by the plural.
EXAMPLE = re.compile(r"^Example:$", re.MULTILINE)

# What announces an indented block of code in reStructuredText.
BLOCK = re.compile(r"::$", re.MULTILINE)


class MarkdownDocstrings(Extension):
    """Rewrites every docstring that is read."""

    def on_object(self, *, obj: Object, **_: Any) -> None:
        """Rewrites the docstring of a class, function, attribute or module."""
        if obj.docstring is not None:
            obj.docstring.value = as_markdown(obj.docstring, obj)


def as_markdown(docstring: Docstring, owner: Object) -> str:
    """The text of a docstring in Markdown."""
    text = _unindented_sources(docstring.value)
    text = EXAMPLE.sub("Examples:", text)
    text = ROLE.sub(lambda role: _link(role[1], owner), text)
    return BLOCK.sub(":", text)


def _unindented_sources(text: str) -> str:
    """The same with paragraphs of sources in bold type, their further lines no longer indented."""
    paragraphs = text.split("\n\n")
    for number, paragraph in enumerate(paragraphs):
        if SOURCE.match(paragraph):
            lines = [line.strip() for line in paragraph.splitlines()]
            paragraphs[number] = SOURCE.sub(r"**\1:** ", "\n".join(lines))
    return "\n\n".join(paragraphs)


def _link(target: str, owner: Object) -> str:
    """A link to what a role names, if some page shows it; else its name in type of code."""
    short = target.rsplit(".", 1)[-1]
    path = target if target.startswith("derain.") else _found(target, owner)
    return f'<autoref identifier="{path}" optional><code>{short}</code></autoref>'


def _found(name: str, owner: Object) -> str:
    """The whole path of a name as its owner's module knows it."""
    try:
        return owner.resolve(name.split(".", 1)[0]) + name[len(name.split(".", 1)[0]) :]
    except Exception:  # a name of some other package, or of the class that is being read
        return name
