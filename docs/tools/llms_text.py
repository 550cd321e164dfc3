"""Lists the pages of the site in ``llms.txt``, as https://llmstxt.org describes it.

    python -m docs.tools.llms_text

After a build: the list is made from the navigation of mkdocs.yml.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

REPOSITORY = Path(__file__).resolve().parents[2]


def main() -> None:
    """Writes the list into the site's folder."""
    site = yaml.safe_load((REPOSITORY / "mkdocs.yml").read_text("utf-8"))
    (REPOSITORY / site["site_dir"] / "llms.txt").write_text(llms_text(site), "utf-8")


def llms_text(site: dict[str, Any]) -> str:
    """Returns the list: a section for each group of the navigation, a link for each page.

    Args:
        site: The content of mkdocs.yml.
    """
    lines = [f"# {site['site_name']}", "", f"> {site['site_description']}"]
    for entry in site["nav"]:
        ((group, pages),) = entry.items()
        lines += ["", f"## {group}", ""]
        lines += [f"- [{title}]({_address(page)})" for title, page in _pages(pages)]
    return "\n".join(lines) + "\n"


def _pages(entries: list[dict[str, Any]]) -> Iterator[tuple[str, str]]:
    """The title and the file of every page below a group."""
    for entry in entries:
        ((title, content),) = entry.items()
        if isinstance(content, list):
            yield from _pages(content)
        else:
            yield title, content


def _address(page: str) -> str:
    """The address of a page on the site, from its root."""
    if page == "index.md":
        return "./"
    return page.removesuffix("index.md").removesuffix(".md").rstrip("/") + "/"


if __name__ == "__main__":
    main()
