"""Measures the gain of each ingredient of a model: trains variants alike, and scores them.

    python -m benchmarks.ingredients --plan benchmarks/ingredients.yaml --out ingredients

The file names data sets, each by the command of derain that makes it, and variants, each by the
options of its `derain fit`; `{name}` stands for the folder of a data set there, and `{name -place}`
for that without the worlds that were drawn at a place. All are trained
with one seed, one after the other. A variant whose model is there, made by the same commands, is
not trained again: a sweep that was stopped goes on. What is scored on is that of
across_sensors.yaml or of another `--columns`, where labels have a part in the scores alone.
"""

import argparse
import json
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from benchmarks.across_sensors import PLAN
from benchmarks.processes import DERAIN
from benchmarks.sensor_table.measure import Measurement
from benchmarks.sensor_table.plan import Plan, Row
from benchmarks.sensor_table.report import add_places, report

# Folder of the data sets; no variant's is called so.
DATA_SETS = "data-sets"

# Name of a data set in the options of a variant, and the place that is left out of it.
DATA_SET = re.compile(r"\{(\w+)( -\w+)?\}")


@dataclass(frozen=True)
class Variant:
    """A model.

    Attributes:
        title: What it is called.
        fit: Options of ``derain fit``; ``{name}`` stands for the folder of a data set, ``{name
            -place}`` for that without a place.
        export: Further options of ``derain export``.
        thresholds: A row of the table for each; none takes the model as it is.
    """

    title: str
    fit: str
    export: str = ""
    thresholds: tuple[float, ...] = ()

    @property
    def folder(self) -> str:
        """Its title as the name of a folder."""
        return re.sub(r"[^\w.]+", "_", self.title).strip("_")

    def rows(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """Titles of its rows in a table, and the settings of each."""
        for threshold in self.thresholds:
            yield f"{self.title}, at {threshold:g}", {"threshold": threshold}
        if not self.thresholds:
            yield self.title, {}


@dataclass(frozen=True)
class Sweep:
    """The variants to train, and the folder.

    Attributes:
        data: Data sets by name, each the command of derain that makes it, but for its folder.
        variants: The models.
        common: Options of every ``derain fit``, before those of the variant. Its configuration is
            taken where the variant names none of its own.
        folder: Where data sets and models go, and are found in again.
    """

    data: Mapping[str, str]
    variants: Sequence[Variant]
    common: str
    folder: Path

    @classmethod
    def of_yaml(cls, path: Path, folder: Path) -> "Sweep":
        """Reads a sweep: ``seed``, ``epochs``, ``common``, ``data`` and ``variants``.

        Variants of a title are options of ``derain fit``, or a mapping of ``fit``, ``export`` and
        ``thresholds``.

        Raises:
            ValueError: Two variants whose folders would be called the same, or one without a name.
        """
        content = yaml.safe_load(path.read_text("utf-8"))
        variants = []
        for title, described in content["variants"].items():
            given = {"fit": described} if isinstance(described, str) else dict(described)
            given.setdefault("thresholds", content.get("thresholds", ()))
            given["thresholds"] = tuple(given["thresholds"])
            variants.append(Variant(title, **given))
        folders = {variant.folder for variant in variants} - {""}
        if len(folders) < len(variants):
            raise ValueError(f"{path}: titles of variants have to differ in their letters")
        alike = f"--seed_everything {content['seed']} --trainer.max_epochs {content['epochs']}"
        common = f"{alike} {content.get('common', '')}".strip()
        return cls(content.get("data", {}), variants, common, folder)

    def model(self, variant: Variant) -> Path:
        """The file of a variant's model."""
        return self.folder / variant.folder / "model.onnx"

    def commands(self, variant: Variant) -> list[list[str]]:
        """The commands that make the model: its data sets, its training, and its export."""
        sets, folder = self.folder / DATA_SETS, self.folder / variant.folder
        named = dict.fromkeys(name for name, _ in DATA_SET.findall(variant.fit))
        made = [[*shlex.split(self.data[name]), "--out", str(sets / name)] for name in named]
        configurations, others = _options(shlex.split(self.common))
        filled = DATA_SET.sub(
            lambda found: shlex.quote(str(sets / "".join(found.groups("")))), variant.fit
        )
        own, changes = _options(shlex.split(filled))
        kept = ["--checkpoint.dirpath", str(folder), "--checkpoint.filename", "model"]
        log = ["--trainer.logger.save_dir", str(folder / "runs")]
        export = ["--out", str(self.model(variant)), *shlex.split(variant.export)]
        return [
            *made,
            ["fit", *(own or configurations), *others, *changes, *log, *kept],
            ["export", str(folder / "model.ckpt"), *export],
        ]

    def listing(self, variant: Variant) -> str:
        """The commands of a variant, for whoever repeats it."""
        lines = [f"    derain {shlex.join(command)}" for command in self.commands(variant)]
        return "\n".join([f"{variant.title}:\n", *lines])

    def train(self, variant: Variant) -> str | None:
        """Makes a variant's model, unless these commands made the one that is there.

        Returns:
            Why there is none; None where all went well.
        """
        folder = self.folder / variant.folder
        record, commands = folder / "commands.txt", self.listing(variant)
        same = record.exists() and record.read_text("utf-8") == commands
        if same and self.model(variant).exists():
            return None
        if folder.exists():
            shutil.rmtree(folder)
        folder.mkdir(parents=True)
        with (folder / "log.txt").open("w") as log:
            for command in self.commands(variant):
                if command[0] == "fit":
                    self._leave_places_out(variant)
                done = subprocess.run(
                    [DERAIN, *command], stdout=log, stderr=subprocess.STDOUT, check=False
                )
                if done.returncode:
                    return f"derain {command[0]} failed; see {folder / 'log.txt'}"
        record.write_text(commands, "utf-8")  # last: what is stopped before is made anew
        return None

    def _leave_places_out(self, variant: Variant) -> None:
        """Makes the data sets of a variant that are others without one place."""
        for name, without in DATA_SET.findall(variant.fit):
            if without:
                sets = self.folder / DATA_SETS
                leave_out(sets / name, without.removeprefix(" -"), sets / f"{name}{without}")


def leave_out(worlds: Path, place: str, folder: Path) -> None:
    """Makes a data set of worlds without those that were drawn at a place, by a link to the others.

    Args:
        worlds: The data set.
        place: The place.
        folder: Folder to make. One that is there is made anew.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / "sequences").symlink_to((worlds / "sequences").absolute())
    manifest = json.loads((worlds / "manifest.json").read_text("utf-8"))
    for part, names in manifest["split"].items():
        drawn = {name: worlds / "sequences" / name / "drawn.yaml" for name in names}
        places = {
            name: yaml.safe_load(file.read_text("utf-8"))["place"] for name, file in drawn.items()
        }
        manifest["split"][part] = [name for name in names if places[name] != place]
    (folder / "manifest.json").write_text(json.dumps(manifest), "utf-8")


def _options(words: Sequence[str]) -> tuple[list[str], list[str]]:
    """The configurations that a training's options name, and the other options.

    A configuration overrides what stands before it, so it has to be named first.
    """
    configurations: list[str] = []
    others: list[str] = []
    rest = iter(words)
    for word in rest:
        if word == "--config":
            configurations += [word, next(rest)]
        else:
            others.append(word)
    return configurations, others


def main() -> None:
    """Trains what is not there, prints the table, and exits with 1 where a variant failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plan", type=Path, default=Path(__file__).with_suffix(".yaml"))
    parser.add_argument("--variants", nargs="+", help="titles of those to train (default: all)")
    parser.add_argument("--columns", type=Path, default=PLAN, help="plan whose columns are scored")
    add_places(parser)
    parser.add_argument(
        "--models", type=Path, default=Path("runs/ingredients"), help="data sets and models"
    )
    arguments = parser.parse_args()

    sweep = Sweep.of_yaml(arguments.plan, arguments.models)
    columns = Plan.of_yaml(arguments.columns)  # read before anything is trained for it
    variants = [v for v in sweep.variants if v.title in (arguments.variants or (v.title,))]
    failed = {}
    for variant in variants:
        print(f"{variant.title}", file=sys.stderr, flush=True)
        if reason := sweep.train(variant):
            failed[variant.title] = reason
    rows = {
        title: Row(str(sweep.model(variant)), settings)
        for variant in variants
        if variant.title not in failed
        for title, settings in variant.rows()
    }
    plan = columns.with_only(rows)
    measurement = Measurement(plan, arguments.shared, arguments.work, arguments.threads)
    measurement.left_out.reasons |= failed
    report(measurement, arguments.out, turned=False, notes=[sweep.listing(v) for v in variants])
    raise SystemExit(bool(failed))


if __name__ == "__main__":
    main()
