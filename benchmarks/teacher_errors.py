"""Measures the cost of a teacher's errors to its student, by the weight of the rarer class.

On simulated streets, of which the truth is known, labels are made to err as a teacher's do: some
rain is taken for solid, some things, whole, for rain, as those are that move, and of some points it
is not known. Students learn from that; the best epoch is that which agrees best with the teacher,
as in `derain learn`; and on streets kept back each is measured by the truth.

derain simulate --layout street --sensor spinning_64 --rain 25 50 100 --sequences 16 --scans 2 \
    --no-radar --out streets
python benchmarks/teacher_errors.py streets --model outdet --balance 1 0.5 0
"""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import lightning
import numpy as np
import torch
from lightning.pytorch.callbacks import ModelCheckpoint

from derain.annotation.teach import (
    TAUGHT_CARD,
    TAUGHT_NOT_RAIN,
    TAUGHT_RAIN,
    TAUGHT_UNKNOWN,
)
from derain.cards.card import DataCard, load_card
from derain.datamodules.augmentation import Augmentation
from derain.datamodules.in_memory import InMemory
from derain.datamodules.scan_data import Loading
from derain.models.measured import MONITOR
from derain.models.outdet import OutDet
from derain.models.salsanext import SalsaNext
from derain.models.supervised import SupervisedModule
from derain.scan import Scan
from derain.sources.folders import named_frames
from derain.system.cores import usable_cores

# Shares of the rain that is missed, of what is called rain and is not, and of what is not known;
# about those of persistence on a drive in snow (precision .8, recall .87).
MISSED, FALSE, UNKNOWN = 0.13, 0.22, 0.08

# Things that are called rain: whatever stands above the road in an upright box of such a side.
SIDE, ABOVE_ROAD, REACH = 2.4, -1.4, 40.0

# Sequences to train on and to choose by; the others measure.
TRAINING, CHOOSING = 10, 2

SIMULATED = load_card("simulated")
CARD = DataCard(
    "taught",
    TAUGHT_CARD.classes,
    rain=(TAUGHT_RAIN,),
    unknown=(TAUGHT_UNKNOWN,),
    intensity_unit=SIMULATED.intensity_unit,
    simulated=True,
)

MODELS: dict[str, Callable[[int, float], SupervisedModule]] = {
    "outdet": lambda epochs, balance: OutDet(
        learning_rate=0.005,
        milestones=(round(0.6 * epochs), round(0.85 * epochs)),
        candidates=0.99,
        balance=balance,
    ),
    "salsanext": lambda epochs, balance: SalsaNext(
        width=8, learning_rate=0.02, decay=0.9, balance=balance
    ),
}


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("streets", type=Path)
    parser.add_argument("--model", choices=MODELS, default="outdet")
    parser.add_argument("--balance", type=float, nargs="+", default=[1.0, 0.5, 0.0])
    parser.add_argument("--epochs", type=int, default=10)
    arguments = parser.parse_args()
    torch.set_num_threads(usable_cores())

    frames = named_frames([arguments.streets], labelled=True)
    scans: dict[str, list[Scan]] = {}
    for frame in frames:
        scan = frame.read()
        scans.setdefault(frame.sequence, []).append(scan.with_label(frame.read_label(len(scan))))
    print("| labels | balance | agreement | P | R | IoU |\n|---|---:|---:|---:|---:|---:|")
    for title, teacher in {"of a teacher": erring, "true": known}.items():
        for balance in arguments.balance:
            model = MODELS[arguments.model](arguments.epochs, balance)
            with TemporaryDirectory() as folder:
                scores = _scores(model, [*scans.values()], teacher, arguments.epochs, folder)
            row = " | ".join(f"{score:.3f}" for score in scores)
            print(f"| {title} | {balance:g} | {row} |", flush=True)


def erring(scan: Scan, generator: np.random.Generator) -> Scan:
    """A labelled simulated scan with the labels of a teacher that errs."""
    label = known(scan, generator).label
    assert label is not None
    rain = label == TAUGHT_RAIN
    solid = (label == TAUGHT_NOT_RAIN) & scan.valid & (scan.xyz[:, 2] > ABOVE_ROAD)
    label[rain & (generator.random(len(scan)) < MISSED)] = TAUGHT_NOT_RAIN
    wrong, wanted = np.zeros(len(scan), bool), FALSE * rain.sum()
    for centre in generator.permutation(np.flatnonzero(solid & (scan.range < REACH))):
        if wrong.sum() >= wanted:
            break
        beside = np.abs(scan.xyz[:, :2] - scan.xyz[centre, :2]) < SIDE / 2
        wrong |= solid & beside.all(axis=1)
    label[wrong] = TAUGHT_RAIN
    label[generator.random(len(scan)) < UNKNOWN] = TAUGHT_UNKNOWN
    return scan.with_label(label)


def known(scan: Scan, _: np.random.Generator) -> Scan:
    """The truth, in the classes of a teacher."""
    label = np.where(SIMULATED.rain_of(scan), TAUGHT_RAIN, TAUGHT_NOT_RAIN)
    label[SIMULATED.unknown_of(scan)] = TAUGHT_UNKNOWN
    return scan.with_label(label)


def _scores(
    model: SupervisedModule,
    sequences: Sequence[Sequence[Scan]],
    teacher: Callable[[Scan, np.random.Generator], Scan],
    epochs: int,
    folder: str,
) -> list[float]:
    """Agreement of the best epoch, and its precision, recall and IoU by the truth."""
    lightning.seed_everything(0, verbose=False)
    generator = np.random.default_rng(1)
    first_chosen, first_test = TRAINING, TRAINING + CHOOSING
    train = [teacher(scan, generator) for one in sequences[:first_chosen] for scan in one]
    choice = [teacher(s, generator) for one in sequences[first_chosen:first_test] for s in one]
    test = [known(scan, generator) for one in sequences[first_test:] for scan in one]
    data = InMemory(train, choice, test, card=CARD, loading=Loading(augmentation=Augmentation()))
    best = ModelCheckpoint(folder, monitor=MONITOR, mode="max")
    trainer = lightning.Trainer(
        max_epochs=epochs,
        accelerator="cpu",
        logger=False,
        callbacks=[best],
        enable_progress_bar=False,
        enable_model_summary=False,
    )
    trainer.fit(model, data)
    model.load_state_dict(torch.load(best.best_model_path, weights_only=True)["state_dict"])
    (scores,) = trainer.test(model, data, verbose=False)
    assert best.best_model_score is not None
    return [
        float(best.best_model_score),
        *(scores[f"test/{n}"] for n in ("precision", "recall", "iou")),
    ]


if __name__ == "__main__":
    main()
