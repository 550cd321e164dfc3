"""Runs a bench, and says what it depends on."""

import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from derain.cards.card import DataCard
from derain.datamodules.base import ScanDataModule
from derain.datamodules.scan_dataset import ScanFile
from derain.evaluation.scores import score
from derain.export.bench.contestant import Contestant
from derain.export.bench.cost import Timing, measure_cost
from derain.export.bench.rows import Row, joined
from derain.export.bench.shared_search import scored_methods
from derain.export.machine import processor, versions
from derain.scan import Scan


@dataclass(frozen=True)
class Labelled:
    """Labelled scans, ready to be judged.

    Attributes:
        card: Says which labels are rain.
        scans: Files of the scans.
        read: Reads one of them, with its labels.
        rain_rate: Rain rate of each scan in mm/h, as far as it is known.
        distinct: Count points at one position once.
    """

    card: DataCard
    scans: Sequence[Path]
    read: Callable[[Path], Scan]
    rain_rate: Mapping[Path, float] = field(default_factory=dict)
    distinct: bool = False


def run_bench(
    contestants: Sequence[Contestant], data: Labelled, timing: Timing, seed: int = 0
) -> list[Row]:
    """Scores every method on every scan, and measures what each costs alone.

    Args:
        contestants: The methods, one or more.
        data: Labelled scans, one or more.
        timing: What the methods are timed on, and how; scoring takes as many threads.
        seed: Of the draws behind the intervals.

    Returns:
        The rows of the table, in the order of the methods.

    Raises:
        InputError: A scan that cannot be read. A method that fails is told in its row.
    """
    scans = tqdm(data.scans, desc="scoring", unit="scan", disable=None)
    scores = score(
        scored_methods(contestants, timing.threads),
        map(data.read, scans),
        data.card,
        data.distinct,
        [data.rain_rate.get(path) for path in data.scans],
    )
    costs = [
        measure_cost(contestant, timing)
        for contestant in tqdm(contestants, desc="timing", unit="method", disable=None)
    ]
    return joined(contestants, scores, costs, np.random.default_rng(seed))


def provenance(
    command: str, module: ScanDataModule, files: Sequence[ScanFile], timing: Timing, seed: int
) -> dict[str, Any]:
    """Everything that a bench depends on besides its methods, as JSON-able primitives.

    Args:
        command: The command line that makes the bench.
        module: Where the scans come from.
        files: The scans, with their labels.
        timing: What the methods were timed on, and how.
        seed: Of the draws behind the intervals.
    """
    card = module.card
    scans = "1 scan" if len(files) == 1 else f"{len(files):,} scans"
    return {
        "title": f"{card.title}, {scans}",
        "command": command,
        "data": card.name,
        "simulated": card.simulated,
        "licence": card.licence,
        "rain": [card.classes[id_] for id_ in card.rain],
        "seed": seed,
        "threads": timing.threads,
        "repeats": timing.repeats,
        "timed_on": [str(path) for path in timing.scans],
        "processor": processor(),
        "system": platform.platform(),
        "versions": versions(),
        "files": [
            {
                "scan": str(file.scan),
                "sha256": _sha256(file.scan),
                "label_sha256": _sha256(file.label) if file.label else None,
            }
            for file in files
        ],
    }


def _sha256(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()
