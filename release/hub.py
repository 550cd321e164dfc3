"""A folder for a model hub: the model that comes with derain, and its card as hubs read it.

    python -m release.hub --out hub

The folder holds README.md, whose front matter a hub reads (licence, library, data, results), beside
model.onnx, model.ckpt and card.yaml, from which it is made.
"""

import argparse
import re
import shutil
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import yaml

from derain.default import ModelCard, default_checkpoint, default_model, model_card
from derain.evaluation.text_tables import markdown_table, number_text
from derain.files.atomic import write_text

PYPROJECT = Path(__file__).resolve().parent.parent / "pyproject.toml"

TAGS = ("lidar", "point-cloud", "rain", "snow", "denoising", "onnx")

# Hubs have no task for points of a scan.
TASK = {"type": "other", "name": "rain and snow in LiDAR scans, point by point"}

# What a score of the card is called on a hub.
METRICS = {
    "iou": "IoU of rain",
    "taken": "share of the points removed",
}

USE = """\
```python
import derain

scan = derain.read_scan("scan.bin")
rain = derain.Derainer("model.onnx")(scan)  # bool, one per point
derain.write_scan("clean.pcd", scan.take(~rain))
```"""


def front_matter(card: ModelCard) -> dict[str, Any]:
    """The front matter of a model card, for hubs.

    Source: the keys, huggingface.co/docs/hub/model-cards.
    """
    return {
        "license": card.licence.lower(),
        "library_name": "derain",
        "tags": [*TAGS],
        "datasets": [_identifier(card.data)],
        "model-index": [{"name": card.name, "results": [_result(one) for one in card.scores]}],
    }


def _result(score: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "task": dict(TASK),
        "dataset": {"type": _identifier(score["data"]), "name": score["data"]},
        "metrics": [
            {"type": name, "name": METRICS[name], "value": score[name]}
            for name in METRICS
            if name in score
        ],
    }


def _identifier(text: str) -> str:
    return re.sub("[^a-z0-9]+", "-", text.lower()).strip("-")


def page(card: ModelCard, repository: str) -> str:
    """A card as Markdown, under its front matter.

    Args:
        card: The card.
        repository: Address of derain's repository.
    """
    rows = [
        [score["data"], number_text(score.get("iou")), number_text(score.get("taken"), ".3%")]
        for score in card.scores
    ]
    parts = [
        f"---\n{_as_yaml(front_matter(card))}---",
        f"# derain: {card.title}",
        f"It takes rain and snow out of LiDAR scans: {card.what}",
        f"Code: <{repository}>",
        USE,
        "## When not to use it",
        _bullets(card.not_for),
        "## How good it is",
        markdown_table(["data", "IoU", "removed"], rows),
        f"Measured by: {card.measured}.",
        "## How it was made",
        f"Learnt from: {card.data}; seed {card.seed}.",
        _bullets(f"`{command}`" for command in card.training),
        f"Threshold {card.threshold:g}: {card.threshold_chosen}.",
        f"SHA-256 of model.onnx: `{card.sha256}`",
    ]
    return "\n\n".join(parts) + "\n"


def _as_yaml(content: dict[str, Any]) -> str:
    text: str = yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
    return text


def _bullets(lines: Iterable[str]) -> str:
    return "\n".join(f"- {line}" for line in lines)


def write(out: Path) -> None:
    """Writes the folder, made if missing; files of these names are replaced.

    Raises:
        InputError: The model is damaged, or the folder cannot be written.
    """
    project = tomllib.loads(PYPROJECT.read_text("utf-8"))["project"]
    text = page(model_card(), project["urls"]["Repository"])
    write_text(out / "README.md", text)
    model = default_model()
    for file in (model, default_checkpoint(), model.with_name("card.yaml")):
        shutil.copy2(file, out)


def main() -> None:
    """Writes the folder."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("hub"), help="(default: %(default)s)")
    out = parser.parse_args().out
    write(out)
    print(f"{out}: {', '.join(sorted(file.name for file in out.iterdir()))}")


if __name__ == "__main__":
    main()
