"""Makes the model that comes with derain from a seed: worlds, training, threshold, file.

    python -m benchmarks.make_default --out made --clean clean/ --unlabelled drive/
    python -m benchmarks.make_default --out made --clean clean/ --seed 1    # on the same worlds

It is trained by `cues_worlds.yaml`, on worlds alone. Leaves ``model.onnx`` and ``model.ckpt`` in
``OUT/seed_<seed>``, and the table that the threshold was chosen by. That is the one of highest IoU
over the worlds that were held out, dry ones among them, raised until no clean scan that is given
loses more than MOST_TAKEN, as long as that costs no more than MOST_LOST of the IoU. What is added
to the log-odds of scans without intensities makes the model agree best with itself, as it judges
unlabelled recordings with their intensities; it is no more than clean scans allow, judged without
theirs. No label of a real scan is read.
"""

import argparse
import json
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.processes import DERAIN
from derain.cards.card import load_card
from derain.datamodules.worlds import Worlds
from derain.errors import InputError
from derain.evaluation.text_tables import markdown_table
from derain.export.onnx_file import export
from derain.export.runtime import Derainer
from derain.models.checkpoint import load_model, save_model
from derain.models.cues import CueFusion
from derain.scan import Bools, Scan
from derain.sources.folders import named_frames

CONFIGURATION = "cues_worlds.yaml"

# Where the configuration makes its worlds.
WORLDS = "runs/worlds"

# Thresholds to choose from.
THRESHOLDS = tuple(np.round(np.arange(0.3, 0.951, 0.05), 2).tolist())

# What may be added to the log-odds of scans without intensities; 0 where there are no unlabelled
# recordings to choose by.
ADDED = tuple(np.arange(0, 4.01, 0.5).tolist())

# Share of clean points that may be taken, and of the highest IoU that may be given for it.
MOST_TAKEN = 3e-4
MOST_LOST = 0.02


def main() -> None:
    """Runs the command."""
    arguments = _parser().parse_args()
    out: Path = arguments.out / f"seed_{arguments.seed}"
    out.mkdir(parents=True, exist_ok=True)
    model = load_model(trained(arguments.out, out / "training", arguments.seed))
    assert isinstance(model, CueFusion)
    unchosen = out / "unchosen.onnx"
    export(model, unchosen)
    derainer = Derainer(str(unchosen))
    iou = _on_worlds(derainer, _held_out(arguments.out / WORLDS))
    taken = {Path(scan.name).name: _taken(derainer, scan) for scan in _scans(arguments.clean)}
    threshold = chosen(iou, taken)
    card = load_card("simulated")  # all its worlds have these classes
    spec = replace(
        model.spec,
        threshold=threshold,
        licence=card.licence,
        classes=card.classes,
        rain=tuple(card.rain),
    )
    model.hparams["threshold"] = threshold
    agreement = _agreements(model, threshold, arguments.unlabelled, arguments.clean)
    added = max(agreement, key=lambda one: agreement[one], default=0.0)
    model.hparams["without_intensity"] = model.network.without_intensity = added
    model.adopt(spec)
    save_model(model, out / "model.ckpt")
    export(model, out / "model.onnx")
    unchosen.unlink()
    table = _table(iou, taken, threshold)
    (out / "threshold.md").write_text(table, "utf-8")
    content = {"threshold": threshold, "iou": iou, "taken": taken, "agreement": agreement}
    (out / "threshold.json").write_text(json.dumps(content, indent=2) + "\n", "utf-8")
    print(table)
    print("added without intensities, and IoU with itself:", agreement)


def trained(folder: Path, training: Path, seed: int) -> Path:
    """The last checkpoint of a training, which is not trained again where that has been done.

    Args:
        folder: Where worlds are made.
        training: Folder of the training. One that did not end is removed, and begun anew.
        seed: Seed of the training.

    Raises:
        InputError: derain failed.
    """
    ended = training / "ended.txt"
    if not ended.exists():
        shutil.rmtree(training, ignore_errors=True)
        save = ["--trainer.logger.init_args.save_dir", str(training.absolute())]
        command = ["fit", "--config", CONFIGURATION, "--seed_everything", str(seed), *save]
        if subprocess.run([DERAIN, *command], cwd=folder, check=False).returncode:
            raise InputError(training, "derain fit failed", "See above.")
        ended.touch()  # last: a training that is stopped before is begun anew
    (checkpoint,) = training.glob("*/version_0/checkpoints/last.ckpt")
    return checkpoint


def chosen(iou: Mapping[float, float], taken: Mapping[str, Mapping[float, float]]) -> float:
    """The threshold of highest IoU, raised as far as clean scans ask, and no farther than it may.

    Args:
        iou: IoU over worlds held out, by threshold.
        taken: Of each clean scan the share of points called rain, by threshold.
    """
    best = max(sorted(iou), key=lambda threshold: iou[threshold])
    possible = [t for t in sorted(iou) if t >= best and iou[t] >= iou[best] - MOST_LOST]
    clean = [t for t in possible if all(of[t] <= MOST_TAKEN for of in taken.values())]
    return clean[0] if clean else possible[-1]


def _held_out(worlds: Path) -> Iterator[tuple[Scan, Bools]]:
    for folder in sorted(worlds.iterdir()):
        data = Worlds(str(folder), make=False)
        for frame in data.source("validation"):
            scan = data.reader.read(frame)
            yield scan, data.card.rain_of(scan)


def _on_worlds(derainer: Derainer, labelled: Iterator[tuple[Scan, Bools]]) -> dict[float, float]:
    """IoU of all scans together, by threshold."""
    hit, either = (np.zeros(len(THRESHOLDS)) for _ in range(2))
    for scan, rain in labelled:
        probability = derainer.probability(scan)
        for number, threshold in enumerate(THRESHOLDS):
            called = probability > threshold
            hit[number] += np.count_nonzero(called & rain)
            either[number] += np.count_nonzero(called | rain)
    iou = hit / np.maximum(either, 1)
    return dict(zip(THRESHOLDS, iou.tolist(), strict=True))


def _taken(derainer: Derainer, scan: Scan) -> dict[float, float]:
    """Share of the points of a scan that is called rain, by threshold."""
    probability = derainer.probability(scan)[scan.valid]
    return {threshold: float((probability > threshold).mean()) for threshold in THRESHOLDS}


def _scans(paths: Sequence[Path]) -> Iterator[Scan]:
    if paths:
        yield from (frame.read() for frame in named_frames(paths))


def _agreements(
    model: CueFusion, threshold: float, recordings: Sequence[Path], clean: Sequence[Path]
) -> dict[float, float]:
    """Agreement of the model with itself by what is added, where clean scans allow it."""
    agreements: dict[float, float] = {}
    for added in ADDED if recordings else ():
        model.network.without_intensity = added
        with tempfile.TemporaryDirectory() as folder:
            export(model, Path(folder) / "model.onnx")
            derainer = Derainer(Path(folder) / "model.onnx")
        taken = (_taken(derainer, _blank(scan))[threshold] for scan in _scans(clean))
        if all(share <= MOST_TAKEN for share in taken):
            agreements[added] = _agreement(derainer, recordings, threshold)
    return agreements


def _agreement(derainer: Derainer, recordings: Sequence[Path], threshold: float) -> float:
    """IoU of what is called rain with intensities and without, the mean over recordings."""
    of_recordings = []
    for recording in recordings:
        both = either = 0
        for scan in _scans([recording]):
            with_them, without = (
                derainer.probability(one) > threshold for one in (scan, _blank(scan))
            )
            both += np.count_nonzero(with_them & without)
            either += np.count_nonzero(with_them | without)
        of_recordings.append(both / max(either, 1))
    return float(np.mean(of_recordings))


def _blank(scan: Scan) -> Scan:
    return replace(scan, intensity=None)


def _table(
    iou: Mapping[float, float],
    taken: Mapping[str, Mapping[float, float]],
    threshold: float,
) -> str:
    columns = [
        "threshold",
        "IoU, worlds held out",
        *(f"{name}, % taken" for name in taken),
    ]
    rows = [
        [
            f"**{one:g}**" if one == threshold else f"{one:g}",
            f"{iou[one]:.4f}",
            *(f"{100 * of[one]:.3f}" for of in taken.values()),
        ]
        for one in THRESHOLDS
    ]
    return markdown_table(columns, rows)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument("--seed", type=int, default=0, help="of the training")
    parser.add_argument("--clean", type=Path, nargs="*", default=[], help="clean scans")
    parser.add_argument(
        "--unlabelled", type=Path, nargs="*", default=[], help="recordings with intensities"
    )
    return parser


if __name__ == "__main__":
    main()
