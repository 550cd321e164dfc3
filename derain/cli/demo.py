"""``derain demo``: the whole story on simulated rain."""

import argparse
import shlex
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from derain.datamodules.simulated import Simulated

SUMMARY = "the whole story on simulated rain, in a few minutes"

DESCRIPTION = """\
Simulates rain on a test track; trains 3D-OutDet, SalsaNext and LiSnowNet-L1 on it, the last without
labels; tests them, exports them, proves and times the exports, compares them, and cleans scans with
the first. Every step is a command of derain, printed before it runs.

  derain demo
  derain demo --out somewhere
"""

# What the networks are called, and the beginning of their configurations' names.
NETWORKS = {"3D-OutDet": "outdet", "SalsaNext": "salsanext", "LiSnowNet-L1": "lisnownet"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("--out", type=Path, default=Path("demo"), help="folder (default: demo)")
    parser.add_argument("--epochs", type=int, help="train for another number of epochs")


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    out: Path = arguments.out
    models = {title: _model(name, out, arguments.epochs) for title, name in NETWORKS.items()}

    from derain.datamodules.simulated import Simulated

    simulated = Simulated(str(out / "simulated"))
    rainiest = simulated.files("test")[-1].scan
    model = next(iter(models.values()))
    _derain("run", str(model), str(rainiest.parent), "--out", str(out / "cleaned"))

    print(f"\n{_table(models, simulated)}\n")
    picture = out / "before_after.png"
    _draw(model, rainiest, picture)
    for path, meaning in {
        out / "*.ckpt": "the trained networks",
        out / "*.onnx": "the same, for a CPU without torch",
        out / "cleaned": "scans without their rain, and labels",
        picture: "one of them, before and after",
        out / "runs": f"for TensorBoard: tensorboard --logdir {out / 'runs'}",
    }.items():
        print(f"{path!s:24} {meaning}")
    return 0


def _model(name: str, out: Path, epochs: int | None) -> Path:
    """Trains a network, tests it and exports it."""
    checkpoint, model = out / f"{name}.ckpt", out / f"{name}.onnx"
    data = ["--config", f"{name}_simulated.yaml", "--data.root", str(out / "simulated")]
    quiet = [] if sys.stderr.isatty() else ["--trainer.enable_progress_bar", "false"]
    log = ["--trainer.logger.save_dir", str(out / "runs")]
    saving = ["--checkpoint.dirpath", str(out), "--checkpoint.filename", name]
    length = ["--trainer.max_epochs", str(epochs)] if epochs else []

    checkpoint.unlink(missing_ok=True)
    _derain("fit", *data, *log, *saving, *length, *quiet)
    _derain("test", *data, *log, "--ckpt_path", str(checkpoint), *quiet)
    _derain("export", str(checkpoint), "--out", str(model))
    return model


def _derain(*arguments: str) -> None:
    """Runs a command of derain, and ends the demo where it fails."""
    from derain.cli.main import main as derain

    print(f"\n$ derain {shlex.join(arguments)}", flush=True)
    if code := derain(list(arguments)):
        raise SystemExit(code)


def _table(models: Mapping[str, Path], simulated: "Simulated") -> str:
    """Error and time of the exported models, and of the rule that they have to beat."""
    from derain.datamodules.base import ScanFile
    from derain.export.comparison import Method, as_table, compare
    from derain.export.runtime import Derainer
    from derain.neighbours import usable_cores
    from derain.one_line_rule import OneLineRule
    from derain.scan import Scan

    labels = {file.scan: file for file in simulated.files("test")}
    training = [simulated.read(file) for file in simulated.files("train")]
    rule = OneLineRule.best((scan, simulated.card.rain_of(scan)) for scan in training)
    methods: dict[str, Method] = {
        **{title: Derainer(model) for title, model in models.items()},
        f"intensity <= {rule.intensity:.2g} and range <= {rule.range:.2g} m": (
            lambda scan, stopwatch: rule(scan)
        ),
    }

    def read(path: Path) -> Scan:
        return simulated.read(labels.get(path, ScanFile(path)))

    rows = compare(methods, list(labels), read, simulated.card)
    return (
        f"Simulated rain, {len(labels)} test scans of tracks not trained on, {usable_cores()} "
        f"threads. Simulated rain is easy: this says nothing of real rain.\n\n{as_table(rows)}"
    )


def _draw(model: Path, scan: Path, picture: Path) -> None:
    """Draws one scan before and after."""
    from derain.export.runtime import Derainer
    from derain.files import read_scan
    from derain.pictures import before_after_figure, save

    before = read_scan(scan)
    title = "Simulated rain, 50 mm/h, cleaned by 3D-OutDet"
    save(before_after_figure(before, Derainer(model)(before), title), picture)
