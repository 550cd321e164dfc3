"""The methods that are the rows of a table across sensors."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TypeVar

from benchmarks.sensor_table.plan import Asked
from derain.cards.card import load_card
from derain.errors import InputError
from derain.export.bench.bench_entries import BenchEntry, GivenMethod, bench_entries
from derain.export.methods import load_method_of_one_scan
from derain.export.onnx_file import export
from derain.export.runtime import Derainer
from derain.models.outdet import OutDet
from derain.models.published import read_state_dict

Found = TypeVar("Found")


@dataclass
class LeftOut:
    """What is not in the table.

    Attributes:
        reasons: Why, by what it is.
    """

    reasons: dict[str, str] = field(default_factory=dict)

    def unless_found(self, what: str, find: Callable[[], Found]) -> Found | None:
        """What is found; None, and a note of the reason, where it is refused."""
        try:
            return find()
        except InputError as error:
            self.reasons[what] = str(error)
            return None


def rows_of(
    methods: Mapping[str, Asked], shared: Path, exported: Path, left_out: LeftOut
) -> list[BenchEntry]:
    """The methods that are the same for every column.

    Args:
        methods: What is asked for, by title.
        shared: Folder that published weights are found below.
        exported: Folder that these are exported to, and found in again.
        left_out: Is told of methods that there are not.
    """
    asked_for = [
        left_out.unless_found(title, partial(_bench_entry, title, asked, shared, exported))
        for title, asked in methods.items()
        if not asked.is_position
    ]
    return [row for row in asked_for if row is not None]


def _bench_entry(title: str, asked: Asked, shared: Path, exported: Path) -> BenchEntry:
    given: GivenMethod = asked.method
    if asked.weights:
        given = _published(asked, shared, exported)
    elif asked.set:
        given = load_method_of_one_scan(asked.method, asked.set)
    (row,) = bench_entries({title: given})
    return row


def _published(asked: Asked, shared: Path, exported: Path) -> Path:
    """Published weights as a model."""
    path = exported / Path(asked.weights).with_suffix(".onnx").name
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        weights = read_state_dict(require(shared / asked.weights))
        export(OutDet.from_published(weights, load_card(asked.card)), path)
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
