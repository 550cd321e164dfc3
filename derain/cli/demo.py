"""``derain demo``: every step from scans to a deployed model, on simulated rain."""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from derain.cli.arguments import count
from derain.cli.demo_scan import clean_own_scans
from derain.cli.narration import Narrator
from derain.cli.results import first_line, iou_on, last_line, proof_of
from derain.cli.scan_options import add_columns
from derain.default import DEFAULT
from derain.files import DEFAULT_COLUMNS
from derain.sources.folders import named_frames
from derain.system.extras import OF_EXPORT, OF_TRAINING, OPEN3D, OPTUNA, require

SUMMARY = "the whole story on simulated rain, in about six minutes"

DESCRIPTION = """\
Lets it rain on simulated streets, and draws a scan of them; trains 3D-OutDet, SalsaNext and
LiSnowNet-L1 on them, the last without labels; exports, proves and times each; cleans scans; and
compares the networks with filters, with the model that comes with derain, and with what every
derainer has to beat. With --scan, that model then cleans scans of your own. Every step is a command
of derain, printed before it runs; what it prints goes to log.txt.

  derain demo
  derain demo --out somewhere
  derain demo --scan scan.pcd
"""

# What the networks are called, and the beginning of their configurations' names.
DEMO_NETWORKS = {"3D-OutDet": "outdet", "SalsaNext": "salsanext", "LiSnowNet-L1": "lisnownet"}

# What they are compared with: the model that comes with derain, a filter, and the baselines that
# every method has to beat.
OTHERS = (DEFAULT, "dror", "position", "intensity", "all", "none")

# 16 streets to train on, 5 to choose by, 5 to test on.
STREETS = (
    *("--layout", "street", "--sequences", "26", "--scans", "3"),
    *("--rain", "0", "10", "25", "50", "--sensor", "mems_64", "--no-radar"),
)

# Columns of the comparison that fit on a screen.
SHOWN = ("method", "P", "R", "F1", "IoU", "IoU 95 %", "ms")


@dataclass(frozen=True)
class Story:
    """What the demonstration does. Another than the usual one takes less time.

    Attributes:
        out: Folder that everything is written to.
        streets: Options of ``derain simulate``.
        networks: Networks that are trained, as ``DEMO_NETWORKS`` calls them.
        others: Methods that they are compared with.
        fit: Options of every training.
        bench: Options of the comparison.
        scan: A scan of the user's own, or a folder of them; None where none is given.
        columns: Names of the columns of its file, where that does not name them.
    """

    out: Path
    streets: Sequence[str] = STREETS
    networks: Sequence[str] = tuple(DEMO_NETWORKS)
    others: Sequence[str] = OTHERS
    fit: Sequence[str] = ()
    bench: Sequence[str] = ()
    scan: Path | None = None
    columns: Sequence[str] = DEFAULT_COLUMNS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("--out", type=Path, default=Path("demo"), help="folder (default: demo)")
    parser.add_argument("--epochs", type=count, help="train for another number of epochs")
    parser.add_argument(
        "--scan", type=Path, help="scan of your own, or folder of scans, to end with"
    )
    add_columns(parser, of="your ")


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    require("demo", *OF_TRAINING, *OF_EXPORT, OPTUNA, OPEN3D)
    epochs = ("--trainer.max_epochs", str(arguments.epochs)) if arguments.epochs else ()
    if arguments.scan is not None:
        # Minutes before it is its turn: what cannot be read is told now.
        named_frames([arguments.scan], arguments.columns)[0].read()
    tell(Story(arguments.out, fit=epochs, scan=arguments.scan, columns=arguments.columns))
    return 0


def tell(story: Story) -> None:
    """Runs every step, and prints its result.

    Raises:
        SystemExit: A step failed.
    """
    from derain.cli.main import main as derain

    out = story.out
    narrator = Narrator(derain, out / "log.txt")
    print(f"Simulated rain, from streets to a table. Everything goes to {out}/\n")
    data, tuned = out / "simulated", out / "dsor.yaml"
    narrator.step("simulate", "--out", str(data), *story.streets, result=last_line)
    narrator.step("tune", "dsor", "--data", str(data), "--out", str(tuned), result=first_line)
    scan = _rainiest(data)
    narrator.step(
        *("view", str(scan), "--card", "simulated", "--methods", "dror", f"dsor, tuned={tuned}"),
        *("--out", str(out / "filters.png")),
        result=lambda _: f"a first picture: {out / 'filters.png'}",
    )
    for title in story.networks:
        _network(narrator, story, title, scan)
        if title == story.networks[0]:
            _clean(narrator, out, title, scan)
    networks = [f"{title}={out / DEMO_NETWORKS[title]}.onnx" for title in story.networks]
    table = narrator.step(
        *("bench", "--data", str(data), "--out", str(out / "bench"), *story.bench),
        *("--methods", *networks, f"dsor, tuned={tuned}", *story.others),
        result=lambda _: f"every method on the same scans: {out / 'bench' / 'bench.md'}",
    )
    print("", *_narrowed(table), "", sep="\n")
    print("Simulated rain on streets not trained on is easy, and says nothing of real rain.")
    if story.scan is not None:
        print("\nScans of your own, by the model that comes with derain:")
        clean_own_scans(narrator, story.scan, story.columns, out / "yours")
        print()
    print(f"Pictures: {out}/filters.png, before_after.png, bench/speed_error.png")
    print(f"Training: tensorboard --logdir {out / 'runs'}")
    print(f"Done in {narrator.elapsed}; what the commands said: {out / 'log.txt'}")


def _network(narrator: Narrator, story: Story, title: str, scan: Path) -> None:
    """Trains a network and exports it, timed on one scan."""
    out, name = story.out, DEMO_NETWORKS[title]
    checkpoint = out / f"{name}.ckpt"
    checkpoint.unlink(missing_ok=True)
    narrator.step(
        *("fit", "--config", f"{name}_simulated.yaml", "--data.root", str(out / "simulated")),
        *("--data.make", "false", "--trainer.logger.save_dir", str(out / "runs")),
        *("--checkpoint.dirpath", str(out), "--checkpoint.filename", name, *story.fit),
        result=lambda printed: f"{title} trained{iou_on(printed, 'streets kept back')}",
    )
    model = checkpoint.with_suffix(".onnx")
    narrator.step(
        *("export", str(checkpoint), "--out", str(model), "--scan", str(scan)),
        result=lambda printed: f"{model.stat().st_size:,} bytes; {proof_of(printed)}",
    )


def _clean(narrator: Narrator, out: Path, title: str, scan: Path) -> None:
    """Cleans the folder of scans that one of them lies in, and draws that one before and after."""
    from derain.export.runtime import Derainer
    from derain.pictures.scan_pictures import before_after_figure, save
    from derain.sources.folders import frame_of

    model, picture = out / f"{DEMO_NETWORKS[title]}.onnx", out / "before_after.png"
    narrator.step(
        *("run", str(model), str(scan.parent), "--out", str(out / "cleaned")), result=last_line
    )
    before = frame_of(scan).read()
    heading = f"Simulated rain, cleaned by {title}"
    save(before_after_figure(before, Derainer(model)(before), heading), picture)
    print(f"  one of them before and after: {picture}")


def _rainiest(data: Path) -> Path:
    """The last scan of the test sequence with the highest rain rate."""
    from derain.datamodules.labelled import rain_rates
    from derain.datamodules.simulated import Simulated

    rates = rain_rates([data], None)
    frames = Simulated(str(data), make=False).frames("test")
    return Path(max(frames, key=lambda frame: (rates[frame.sequence], frame.key)).name)


def _narrowed(lines: Sequence[str]) -> list[str]:
    """The table that is among these lines, with no other columns than those of ``SHOWN``."""
    rows = [line.strip("|").split("|") for line in lines if line.startswith("|")]
    shown = [number for number, name in enumerate(rows[0]) if name.strip() in SHOWN]
    return ["|".join(["", *(row[number] for number in shown), ""]) for row in rows]
