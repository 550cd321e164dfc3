"""The methods and the labelled scans of a table across sensors, found or made."""

import shlex
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TypeVar

from benchmarks.sensor_table.plan import LabelledData, Row
from derain.cards.card import load_card
from derain.cli.main import main as derain
from derain.datamodules.base import Loading, Part
from derain.datamodules.labelled import card_of, labelled_scans
from derain.errors import InputError
from derain.export.bench.bench_entries import BenchEntry, GivenMethod, bench_entries
from derain.export.bench.labelled_frames import LabelledFrames
from derain.export.methods import load_method_of_one_scan
from derain.export.onnx_file import export
from derain.export.runtime import Derainer
from derain.models.outdet import OutDet
from derain.models.published import read_state_dict

Found = TypeVar("Found")


@dataclass
class LeftOut:
    """Entries that are missing in the table.

    Attributes:
        reasons: Why, by what it is.
    """

    reasons: dict[str, str] = field(default_factory=dict)

    def unless_found(self, what: str, find: Callable[[], Found]) -> Found | None:
        """The input if it is found; None, and a note of the reason, if it is refused."""
        try:
            return find()
        except InputError as error:
            self.reasons[what] = str(error)
            return None


def rows_of(
    methods: Mapping[str, Row], shared: Path, exported: Path, left_out: LeftOut
) -> list[BenchEntry]:
    """The methods that are the same for every column.

    Args:
        methods: The rows, by title.
        shared: Folder that published weights are found below.
        exported: Folder that these are exported to, and found in again.
        left_out: Takes the methods that there are not.
    """
    found = [
        left_out.unless_found(title, partial(_bench_entry, title, row, shared, exported))
        for title, row in methods.items()
        if not row.is_position
    ]
    return [row for row in found if row is not None]


def _bench_entry(title: str, row: Row, shared: Path, exported: Path) -> BenchEntry:
    given: GivenMethod = row.method
    if row.weights:
        given = _published(row, shared, exported)
    elif row.set:
        given = load_method_of_one_scan(row.method, row.set)
    (entry,) = bench_entries({title: given})
    return entry


def _published(row: Row, shared: Path, exported: Path) -> Path:
    """Published weights as a model."""
    path = exported / Path(row.weights).with_suffix(".onnx").name
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        weights = read_state_dict(require(shared / row.weights))
        export(OutDet.from_published(weights, load_card(row.card)), path)
    return path


def file_sizes(rows: Iterable[BenchEntry]) -> Iterator[tuple[str, int]]:
    """Title and bytes of the rows that are a file."""
    for row in rows:
        method = row.ready(1)
        if isinstance(method, Derainer):
            yield row.title, method.path.stat().st_size


def require(path: Path) -> Path:
    """A path that is there.

    Raises:
        InputError: It is not.
    """
    if not path.exists():
        raise InputError(path, "is not there", "Name the folder that it lies below by --shared.")
    return path


@dataclass
class DataFinder:
    """Finds scans, and makes those that are to be simulated.

    Attributes:
        shared: Folder that the others are found below.
        simulated: Folder that simulated data sets lie in, each named by the options that make it.
    """

    shared: Path
    simulated: Path
    _complete: set[Path] = field(default_factory=set)

    def measured(self, data: LabelledData) -> LabelledFrames:
        """The scans that are measured: of a data set its test part.

        Of one without rain, where nobody learns anything, every part.

        Raises:
            InputError: They are not there, or cannot be simulated.
        """
        parts: Sequence[Part] = ("train", "validation", "test") if data.taken else ("test",)
        return self._found(data, parts)

    def of_places(self, data: LabelledData) -> LabelledFrames:
        """Other scans of the same data, from which places can be learnt.

        Raises:
            InputError: There are none, or they are not there.
        """
        if data.position:
            return self._found(LabelledData(data.position, card=data.card), ("train",))
        if data.simulate:
            return self._found(data, ("train",))
        raise InputError(
            ", ".join(data.scans), "there are no others to learn places from", "Name some."
        )

    def _found(self, data: LabelledData, parts: Sequence[Part]) -> LabelledFrames:
        if data.simulate:
            paths = [self._made(data.simulate)]
        else:
            paths = [require(self.shared / scans) for scans in data.scans]
        found = labelled_scans(paths, card_of(paths, data.card), Loading())
        frames = [frame for part in parts for frame in found.frames(part)]
        return LabelledFrames(found.reader, frames)

    def _made(self, options: str) -> Path:
        """The folder of a simulated data set, which is taken as it is where it is complete."""
        words = options.replace("--", "").replace("/", "_").split()
        folder = self.simulated / "-".join(words)
        if folder not in self._complete:
            with redirect_stdout(sys.stderr):  # the table goes to the other
                if derain(["simulate", "--out", str(folder), *shlex.split(options)]):
                    raise InputError(folder, "could not be simulated", "See above.")
            self._complete.add(folder)
        return folder
