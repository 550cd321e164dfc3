"""The Spec: everything needed to use a trained network besides its weights."""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from derain.errors import InputError
from derain.files.documents import Entry, shown
from derain.scan import LARGEST_ID, Scan
from derain.views.candidates import Candidates, candidates_at
from derain.views.channels import MOST_CHANNELS
from derain.views.one_viewpoint import viewpoint_issues
from derain.views.scan_issues import (
    ScanIssue,
    intensity_unlike_training,
    missing_channels,
    missing_intensity,
)
from derain.views.view import VIEWS, View

SCHEMA = 1

# A channel of derain 0.2, the place of a return in its ray, which gained nothing.
GONE = "dual_return"


@dataclass(frozen=True)
class Spec:
    """The description of how a trained network is used, in its checkpoint and its ONNX file.

    Attributes:
        network: Name of the network, such as ``outdet``.
        view: Kind and parameters of the view that it sees a scan through.
        channels: Its input channels, in order.
        units: Their units.
        mean: Mean of each channel over the training points; it stands in for values that a scan
            lacks.
        std: Standard deviation of each channel over the training points.
        classes: Names of the training data's semantic classes, by id.
        rain: Ids of those that count as rain.
        rule: Constants of the network's own rule for rain, by name; empty where it has none.
        threshold: A point is rain where its probability is greater.
        data: Name of the training data.
        licence: Licence of the training data.
        candidates: Bounds outside which it calls nothing rain; None where it judges every point.
        training: Training data, by `derain.sources.training_record`: names of
            sequences, fingerprints of scans. Empty where that is not known.
        schema: Version of this layout.
    """

    network: str
    view: Mapping[str, Any]
    mean: tuple[float, ...]
    std: tuple[float, ...]
    classes: Mapping[int, str]
    rain: tuple[int, ...]
    data: str
    licence: str
    channels: tuple[str, ...]
    units: tuple[str, ...]
    rule: Mapping[str, float] = field(default_factory=dict)
    threshold: float = 0.5
    candidates: Candidates | None = None
    training: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    schema: int = SCHEMA

    def as_dict(self) -> dict[str, Any]:
        """The Spec as JSON-able primitives."""
        return json.loads(json.dumps(asdict(self)))  # type: ignore[no-any-return]

    @classmethod
    def from_dict(cls, content: Mapping[str, Any], source: str | Path) -> "Spec":
        """Reads a Spec back. It is not trusted: every value is looked at before it is used.

        Args:
            content: A result of :meth:`as_dict`, of this derain or of an earlier one: what has a
                default may be missing.
            source: The file it was found in, for messages.

        Raises:
            InputError: Something that is not a Spec, or one of a later derain.
        """
        entry = Entry("its Spec", "", content)
        try:
            spec = cls(**entry.record(_PARSERS, _REQUIRED))
            _refuse_contradictions(spec, entry)
            _view_of(entry.members()["view"], spec)
        except InputError as error:
            remedy = "Upgrade derain, or export it again."
            if GONE in error.reason:
                remedy = f"Train it again without {GONE}."
            raise InputError(source, f"{error.subject}: {error.reason}", remedy) from error
        return spec

    @property
    def intensity_unit(self) -> str:
        """Unit of the training data's intensity."""
        return dict(zip(self.channels, self.units, strict=True)).get("intensity", "not used")

    @property
    def weighs_intensity(self) -> bool:
        """True if intensities matter to the network, as a channel or by how its view ranks them."""
        return "intensity" in self.channels or VIEWS[self.view["kind"]].WEIGHS_INTENSITY

    def issues(self, scan: Scan) -> Iterator[ScanIssue]:
        """Warnings about a scan for the network, before it is judged.

        Args:
            scan: The scan, its intensities in the unit of the training data.
        """
        yield from viewpoint_issues(scan)
        yield from missing_channels(scan, self.means, self.data)
        mean = self.means.get("intensity", 0.0)  # 0 for a network that sees none
        yield from intensity_unlike_training(scan, mean, self.intensity_unit, self.data)
        if self.weighs_intensity and "intensity" not in self.channels:
            yield from missing_intensity(scan, "the model uses geometry alone, and finds less rain")

    def make_view(self, threads: int = 0) -> View:
        """The view that the network sees a scan through.

        Args:
            threads: Threads it may use; 0 takes every core this process may use.

        Raises:
            InputError: An unknown kind of view, or one without candidates.
        """
        return _view_of(Entry(self.network, "view", dict(self.view)), self, threads)

    @property
    def means(self) -> dict[str, float]:
        """Mean of each channel over the training points, by its name."""
        return dict(zip(self.channels, self.mean, strict=True))


def _view_of(entry: Entry, spec: Spec, threads: int = 0) -> View:
    """The view that an entry describes, with the channels and the candidates of a Spec."""
    kind = entry.members().get("kind", Entry(entry.source, f"{entry.key}.kind", None))
    if not isinstance(kind.value, str) or kind.value not in VIEWS:
        raise kind.fault(f"unknown view {shown(kind.value)}", "Upgrade derain.")
    view = VIEWS[kind.value].of(entry, spec.channels, spec.means, threads)
    return view if spec.candidates is None else view.with_candidates(spec.candidates)


def _refuse_contradictions(spec: Spec, entry: Entry) -> None:
    """Refuses values that are possible one by one, but not together."""
    if len({len(spec.channels), len(spec.units), len(spec.mean), len(spec.std)}) > 1:
        raise entry.fault("channels, units, mean and std differ in number", "Write one each.")
    if not spec.channels or len(set(spec.channels)) < len(spec.channels):
        raise entry.fault(
            f"channels {shown(spec.channels)} are none, or not distinct", "Name them."
        )
    if not set(spec.rain) <= set(spec.classes):
        raise entry.fault(f"rain {shown(spec.rain)} is not of its classes", "Name ids of them.")


def _channels(entry: Entry) -> tuple[str, ...]:
    if len(entry.items()) > MOST_CHANNELS:
        raise entry.fault(f"more than {MOST_CHANNELS} channels", "Name fewer.")
    channels = entry.texts()
    if GONE in channels:
        raise entry.fault(f"the channel {GONE} is no longer computed", "Leave it out.")
    return channels


# What reads each part of a Spec.
_PARSERS: dict[str, Callable[[Entry], Any]] = {
    "network": Entry.text,
    "view": lambda entry: entry.each(lambda part: part.value),
    "mean": Entry.numbers,
    "std": lambda entry: entry.numbers(read=Entry.positive),
    "classes": lambda entry: entry.texts_by_number(LARGEST_ID),
    "rain": lambda entry: tuple(item.whole(0, LARGEST_ID) for item in entry.items()),
    "data": Entry.text,
    "licence": Entry.text,
    "channels": _channels,
    "units": Entry.texts,
    "rule": lambda entry: entry.each(Entry.number),
    "threshold": lambda entry: entry.within(0, 1),
    "candidates": candidates_at,
    "training": lambda entry: entry.each(Entry.texts),
    "schema": lambda entry: entry.whole(1, SCHEMA),
}

_REQUIRED = [part.name for part in fields(Spec) if part.default is MISSING is part.default_factory]
