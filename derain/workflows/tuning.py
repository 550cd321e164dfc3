"""Tunes filters and thresholds of models on labelled scans."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import yaml
from tqdm import tqdm

from derain.cards.rain_found import require_rain
from derain.datamodules.scan_data import ScanData
from derain.export.methods import load_method_of_one_scan
from derain.export.runtime import Derainer
from derain.export.storage import Storage
from derain.export.tuning import (
    LabelledNeighbourhoods,
    Tuned,
    neighbours_to_find,
    tune_filter,
    tune_threshold,
)
from derain.files.atomic import write_text
from derain.filters import filter_from
from derain.filters.derainer import CANDIDATES
from derain.sources.frame import Frame
from derain.sources.training_record import training_overlap
from derain.system.notices import Notices, warn
from derain.views.candidate_fit import fit_candidates
from derain.views.candidates import Candidates


def bounds_of_rain(data: ScanData, frames: Sequence[Frame], inside: float) -> Candidates | None:
    """Bounds that hold a share of the scans' rain; None if no bounds separate rain from the rest.

    Args:
        data: Options for reading scans.
        frames: The scans.
        inside: The share, 0 to 1.

    Raises:
        InputError: A scan that cannot be read.
    """
    shown = tqdm(frames, desc="bounding rain", unit="scan", disable=None)
    known = (data.card.known_points(data.reader.read_measured(frame)) for frame in shown)
    return fit_candidates(known, ("intensity",), inside)


def tune_filter_on(
    name: str,
    data: ScanData,
    frames: Sequence[Frame],
    trials: int,
    *,
    seed: int = 0,
    storage: Storage | None = None,
    candidates: Candidates | None = None,
    threads: int = 0,
) -> Tuned:
    """Searches the parameters of a filter, and warns of scans that do not suit it.

    Args:
        name: The filter.
        data: Options for reading scans.
        frames: The scans.
        trials: Trials in all.
        seed: Of the sampler.
        storage: Storage of the trials, shared with other searches; None keeps nothing.
        candidates: Bounds outside which nothing is called rain; None where anything may be.
        threads: Threads of the search for neighbours; 0 takes every core.

    Returns:
        The parameters, those of the candidates included.

    Raises:
        InputError: A scan that cannot be read, scans without rain, or as for
            :func:`derain.export.tuning.tune_filter`.
    """
    if storage is not None:
        storage.open()  # before the neighbours are found, which takes long
    notices, default, neighbours = Notices(), filter_from(name, {}), neighbours_to_find(name)
    scans = {}
    for frame in tqdm(frames, desc="finding neighbours", unit="scan", disable=None):
        scan = data.reader.read_measured(frame)
        notices.warn(frame.name, default.issues(scan))
        found = LabelledNeighbourhoods.of(scan, data.card, neighbours, threads, candidates)
        scans[frame.name] = found
    require_rain(any(scan.rain.any() for scan in scans.values()), data.card, "--data")
    with tqdm(desc="tuning", unit="trial", total=trials, disable=None) as progress:
        tuned = tune_filter(name, scans, trials, seed, storage, progress.update)
    notices.warn_of_repeats()
    if candidates is None:
        return tuned
    return replace(tuned, parameters={**tuned.parameters, CANDIDATES: candidates.as_dict()})


def tune_model_on(name: str, data: ScanData, frames: Sequence[Frame], threads: int = 0) -> Tuned:
    """Finds the best threshold of a model, and warns of scans that do not suit it.

    Args:
        name: ``default``, or the model's file.
        data: Options for reading scans.
        frames: The scans.
        threads: Threads to use; 0 takes every core.

    Raises:
        InputError: No such model, a scan that cannot be read, or scans without rain.
    """
    derainer, notices = load_method_of_one_scan(name, {}, threads), Notices()
    assert isinstance(derainer, Derainer)  # filters have no threshold
    if note := training_overlap(name, derainer.spec, data.card, frames):
        warn(note)
    scans = []
    for frame in tqdm(frames, desc="judging", unit="scan", disable=None):
        scan = data.reader.read_measured(frame)
        known = scan.valid & ~data.card.unknown_of(scan)
        judgement = derainer.judge(scan)
        notices.warn(frame.name, derainer.issues(judgement))
        scans.append((judgement.probability[known], data.card.rain_of(scan)[known]))
    require_rain(any(rain.any() for _, rain in scans), data.card, "--data")
    notices.warn_of_repeats()
    return tune_threshold(scans, derainer.spec.threshold)


def write_parameters(
    path: Path, method: str, parameters: Mapping[str, Any], *comments: str
) -> None:
    """Writes parameters as :func:`derain.export.methods.read_parameters` reads them.

    Args:
        path: The YAML file.
        method: Name of the method, or the way from the file to a model.
        parameters: Its parameters by name.
        comments: Lines above them.

    Raises:
        InputError: It cannot be written.
    """
    text = yaml.safe_dump({"method": method, **parameters}, sort_keys=False)
    write_text(path, "".join(f"# {line}\n" for line in comments) + text)
