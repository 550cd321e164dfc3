"""``derain demo``: the whole story on simulated rain."""

import argparse
import shlex
import sys
from pathlib import Path

SUMMARY = "the whole story on simulated rain, in under ten minutes"

DESCRIPTION = """\
Simulates rain on a test track; trains 3D-OutDet, SalsaNext and LiSnowNet-L1 on it, the last without
labels; tests them, exports them, proves and times the exports; tunes a filter; cleans scans; and
compares the networks with the filters and with what every derainer has to beat. Every step is a
command of derain, printed before it runs.

  derain demo
  derain demo --out somewhere
"""

# What the networks are called, and the beginning of their configurations' names.
NETWORKS = {"3D-OutDet": "outdet", "SalsaNext": "salsanext", "LiSnowNet-L1": "lisnownet"}

# What learns nothing, and what nothing worth having is worse than.
OTHERS = ("dror", "dsor", "ssr", "position", "intensity", "all", "none")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("--out", type=Path, default=Path("demo"), help="folder (default: demo)")
    parser.add_argument("--epochs", type=int, help="train for another number of epochs")


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    out: Path = arguments.out
    models = {title: _model(name, out, arguments.epochs) for title, name in NETWORKS.items()}

    from derain.datamodules.simulated import Simulated

    data = out / "simulated"
    rainiest = Simulated(str(data)).files("test")[-1].scan
    _derain("run", str(models["3D-OutDet"]), str(rainiest.parent), "--out", str(out / "cleaned"))
    picture = out / "before_after.png"
    _draw(models["3D-OutDet"], rainiest, picture)

    tuned = out / "dsor.yaml"
    _derain("tune", "dsor", "--data", str(data), "--out", str(tuned))
    methods = [*(f"{title}={model}" for title, model in models.items()), *OTHERS]
    bench = out / "bench"
    _derain(
        *("bench", "--data", str(data), "--out", str(bench)),
        *("--methods", *methods, f"dsor, tuned={tuned}"),
    )
    print("\nSimulated rain on tracks not trained on: it is easy, and says nothing of real rain.\n")
    for path, meaning in {
        out / "*.ckpt": "the trained networks",
        out / "*.onnx": "the same, for a CPU without torch",
        out / "cleaned": "scans without their rain, and labels",
        picture: "one of them, before and after",
        bench: "the table above, in full, and its picture speed_error.png",
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


def _draw(model: Path, scan: Path, picture: Path) -> None:
    """Draws one scan before and after."""
    from derain.export.runtime import Derainer
    from derain.files import read_scan
    from derain.pictures import before_after_figure, save

    before = read_scan(scan)
    title = "Simulated rain, 50 mm/h, cleaned by 3D-OutDet"
    save(before_after_figure(before, Derainer(model)(before), title), picture)
