"""Links that lead out of the documentation, to files of the repository, become names.

An extension of Python-Markdown: read in the repository such a link opens its file, which the site
does not have.
"""

import re

from markdown import Markdown
from markdown.extensions import Extension
from markdown.preprocessors import Preprocessor

FOLDERS = "examples|derain|configs|benchmarks|tests"
OUTSIDE = re.compile(rf"\[([^]]+)\]\((?:\.\./)+(?:{FOLDERS}|[A-Z]+\.md)[^)]*\)")

# Links that snippets bring are there by then: snippets are inserted at 32.
AFTER_SNIPPETS = 31


class OutsideLinks(Preprocessor):
    """Replaces each link by its text."""

    def run(self, lines: list[str]) -> list[str]:
        """Returns the lines of a page without such links."""
        return OUTSIDE.sub(r"\1", "\n".join(lines)).split("\n")


class OutsideLinksExtension(Extension):
    """Adds the above to Python-Markdown."""

    def extendMarkdown(self, md: Markdown) -> None:  # noqa: N802
        """Registers the preprocessor."""
        md.preprocessors.register(OutsideLinks(md), "outside_links", AFTER_SNIPPETS)


def makeExtension(**options: object) -> OutsideLinksExtension:  # noqa: N802
    """Makes the extension, for Python-Markdown."""
    return OutsideLinksExtension(**options)
