"""Makes the model that comes with derain from a seed: worlds, training, threshold, file.

    python -m benchmarks.make_default --out made
    python -m benchmarks.make_default --out made --clean clean/    # counts clean scans, too
    python -m benchmarks.make_default --out made1 --seed 1 --worlds made/worlds
    python -m benchmarks.make_default --out cues --cues made/model.ckpt --clean clean/

It is trained on one world and then, at a lower rate, on a calm one, in which whatever lies alone
right before the sensor is of its carrier. With ``--cues`` there is one training, of the network of
cues on a geometry that has been trained, on other scans of the first world; the model that comes
with derain is not made so. Leaves ``model.onnx`` and ``model.ckpt`` in the folder, and the table
that the threshold was chosen by. That is the one of highest IoU over scans of the first world that
were held out, raised until no clean scan that is given loses more than MOST_TAKEN (with cues,
MOST_TAKEN_BY_CUES), as long as that costs no more than MOST_LOST of the IoU. No label of a real
scan is read.
"""

import argparse
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.stages import Stage, trained
from derain.cards.card import load_card
from derain.datamodules.worlds import Worlds
from derain.evaluation.text_tables import markdown_table
from derain.export.onnx_file import export
from derain.export.runtime import Derainer
from derain.models.checkpoint import load_model, save_model
from derain.scan import Scan
from derain.sources.folders import named_frames

# Thresholds to choose from.
THRESHOLDS = tuple(np.round(np.arange(0.3, 0.951, 0.05), 2).tolist())

# Share of a clean scan that may be taken, and of the highest IoU that may be given for it.
MOST_TAKEN, MOST_TAKEN_BY_CUES = 1e-3, 3e-4
MOST_LOST = 0.02


def main() -> None:
    """Runs the command."""
    arguments = _parser().parse_args()
    out: Path = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    worlds = arguments.worlds or out / "worlds"
    first = Stage("world", worlds / "world", 900, 60, 10, 0.005)
    second = Stage("calm", worlds / "calm", 320, 40, 4, 0.002)
    cues = Stage("world", worlds / "others", 500, 60, 16, 0.005, 7, "cued_outdet_worlds.yaml")
    trainings = out / "trainings"
    if arguments.cues is None:
        checkpoint = trained(first, trainings / "world", arguments.seed)
        checkpoint = trained(second, trainings / "calm", arguments.seed, start=checkpoint)
    else:
        checkpoint = trained(cues, trainings / "cues", arguments.seed, start=arguments.cues)
    unchosen = out / "unchosen.onnx"
    model = load_model(checkpoint)
    export(model, unchosen)
    derainer = Derainer(str(unchosen))
    iou = _iou(derainer, _held_out(cues if arguments.cues else first))
    taken = {Path(scan.name).name: _taken(derainer, scan) for scan in _scans(arguments.clean)}
    threshold = chosen(iou, taken, MOST_TAKEN_BY_CUES if arguments.cues else MOST_TAKEN)
    # Both worlds are simulated: what it was started from has the same licence.
    licence = load_card("simulated").licence
    spec = replace(model.spec, threshold=threshold, licence=licence)
    model.hparams["threshold"] = threshold
    model.adopt(spec)
    save_model(model, out / "model.ckpt")
    export(model, out / "model.onnx")
    unchosen.unlink()
    table = _table(iou, taken, threshold)
    (out / "threshold.md").write_text(table, "utf-8")
    content = {"threshold": threshold, "iou": iou, "taken": taken}
    (out / "threshold.json").write_text(json.dumps(content, indent=2) + "\n", "utf-8")
    print(table)


def chosen(
    iou: Mapping[float, float],
    taken: Mapping[str, Mapping[float, float]],
    most_taken: float = MOST_TAKEN,
) -> float:
    """The threshold of highest IoU, raised as far as clean scans ask, and no farther than it may.

    Args:
        iou: IoU over worlds held out, by threshold.
        taken: Of each clean scan the share of its points called rain, by threshold.
        most_taken: Share of a clean scan that may be taken.
    """
    best = max(sorted(iou), key=lambda threshold: iou[threshold])
    possible = [t for t in sorted(iou) if t >= best and iou[t] >= iou[best] - MOST_LOST]
    clean = [t for t in possible if all(of[t] <= most_taken for of in taken.values())]
    return clean[0] if clean else possible[-1]


def _held_out(stage: Stage) -> Iterator[tuple[Scan, NDArray[np.bool_]]]:
    data = Worlds(str(stage.root), stage.campaign)
    for frame in data.source("validation"):
        scan = data.read(frame)
        yield scan, data.card.rain_of(scan)


def _iou(
    derainer: Derainer, labelled: Iterator[tuple[Scan, NDArray[np.bool_]]]
) -> dict[float, float]:
    """IoU by threshold, of the points of all scans together."""
    hit, either = np.zeros(len(THRESHOLDS)), np.zeros(len(THRESHOLDS))
    for scan, rain in labelled:
        probability = derainer.probability(scan)
        for number, threshold in enumerate(THRESHOLDS):
            called = probability > threshold
            hit[number] += np.count_nonzero(called & rain)
            either[number] += np.count_nonzero(called | rain)
    return dict(zip(THRESHOLDS, (hit / np.maximum(either, 1)).tolist(), strict=True))


def _taken(derainer: Derainer, scan: Scan) -> dict[float, float]:
    """Share of the points of a scan that is called rain, by threshold."""
    probability = derainer.probability(scan)[scan.valid]
    return {threshold: float((probability > threshold).mean()) for threshold in THRESHOLDS}


def _scans(paths: Sequence[Path]) -> Iterator[Scan]:
    if paths:
        yield from (frame.read() for frame in named_frames(paths))


def _table(
    iou: Mapping[float, float], taken: Mapping[str, Mapping[float, float]], threshold: float
) -> str:
    columns = ["threshold", "IoU, worlds held out", *(f"{name}, % taken" for name in taken)]
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
    parser.add_argument("--worlds", type=Path, help="worlds that are there (default: OUT/worlds)")
    parser.add_argument("--seed", type=int, default=0, help="of the training")
    parser.add_argument("--cues", type=Path, help="train cues on this checkpoint's geometry")
    parser.add_argument("--clean", type=Path, nargs="*", default=[], help="clean scans")
    return parser


if __name__ == "__main__":
    main()
