"""Links that lead out of the documentation, to files of the repository, become names.

A hook of MkDocs: read in the repository such a link opens its file, which the site does not have.
"""

import re
from typing import Any

FOLDERS = "examples|derain|configs|benchmarks|tests"
OUTSIDE = re.compile(rf"\[([^]]+)\]\((?:\.\./)+(?:{FOLDERS}|\w+\.md)[^)]*\)")


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Replaces links of the pages that lie directly in docs, which so lead out of it."""
    return markdown if "/" in page.file.src_uri else OUTSIDE.sub(r"\1", markdown)
