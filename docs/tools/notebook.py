"""Shows the site a notebook: its cells, and what they printed and drew, as Markdown.

    python -m docs.tools.notebook docs/first_scan.ipynb build/docs/first_scan.md

Before a build: a page of the site takes the result in as a snippet.
"""

import argparse
import json
from pathlib import Path
from typing import Any


def main() -> None:
    """Writes the Markdown."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("notebook", type=Path)
    parser.add_argument("page", type=Path)
    arguments = parser.parse_args()
    cells = json.loads(arguments.notebook.read_text("utf-8"))["cells"]
    arguments.page.write_text("\n\n".join(map(_markdown, cells)) + "\n", "utf-8")


def _markdown(cell: dict[str, Any]) -> str:
    """A cell as Markdown."""
    source = "".join(cell["source"])
    if cell["cell_type"] == "markdown":
        return source
    blocks = [f"```python\n{source}\n```"]
    for output in cell["outputs"]:
        if output["output_type"] == "stream":
            blocks.append(f"```text\n{''.join(output['text'])}```")
        else:
            blocks.append(f"![](data:image/png;base64,{output['data']['image/png']})")
    return "\n\n".join(blocks)


if __name__ == "__main__":
    main()
