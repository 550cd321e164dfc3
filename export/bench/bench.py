"""Runs a bench, and says what it depends on."""

import platform
from collections.abc import Sequence
from typing import Any

import numpy as np
from tqdm import tqdm

from derain.datamodules.base import ScanDataModule
from derain.datamodules.labelled import full_name
from derain.export.bench.contestants import Contestant
from derain.export.bench.cost import Timing, measure_cost
from derain.export.bench.rows import Row, joined
from derain.export.bench.scores import Labelled, score
from derain.export.latency import processor, versions
from derain.sources.frame import Frame


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
    scores = score(contestants, data, timing.threads)
    costs = [
        measure_cost(contestant, timing)
        for contestant in tqdm(contestants, desc="timing", unit="method", disable=None)
    ]
    return joined(contestants, scores, costs, np.random.default_rng(seed))


def provenance(
    command: str, module: ScanDataModule, files: Sequence[Frame], timing: Timing, seed: int
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
        "title": f"{full_name(card)}, {scans}",
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
            dict(
                zip(("scan", "sha256", "label_sha256"), (file.name, *file.checksums()), strict=True)
            )
            for file in files
        ],
    }
