"""Reads a recording to look at back, by Rerun's own reader."""

from pathlib import Path
from typing import Any

from rerun.chunk import RrdReader

from derain.pictures.entities import FRAME, TIME
from derain.scan import Float32s

POSITIONS, CLEAR = "Points3D:positions", "Clear:is_recursive"
ROW = "rerun.controls.RowId"


class ReadBack:
    """What stands in a file.

    Attributes:
        blueprints: How many layouts it has.
        timelines: Names of its timelines.
        seconds: When each scan was taken, by its number.
        entities: Where something stands, but for what the format itself writes.
    """

    def __init__(self, path: Path) -> None:
        reader = RrdReader(path)
        self.blueprints = len(reader.blueprints())
        self._values: dict[tuple[str, str], dict[int | None, Any]] = {}
        self._rows: dict[tuple[str, str], dict[int | None, bytes]] = {}
        self.timelines: set[str] = set()
        self.seconds: dict[int, float] = {}
        for chunk in reader.stream():
            if not chunk.entity_path.startswith("/__"):
                self._take(chunk.entity_path, chunk.to_record_batch())
        self.entities = {entity for entity, _ in self._values}

    def values(self, entity: str, component: str) -> dict[int | None, Any]:
        """What a component is, by the number of the scan; None for what it is at all times."""
        return self._values.get((entity, component), {})

    def points(self, entity: str) -> dict[int | None, Float32s]:
        """The points of an entity by the number of the scan, float32 (N, 3)."""
        found = self.values(entity, POSITIONS)
        return {n: xyz.flatten().to_numpy().reshape(-1, 3) for n, xyz in found.items()}

    def numbers(self, entity: str) -> dict[int | None, float]:
        """The scalar of an entity by the number of the scan."""
        return {n: value[0] for n, value in self.values(entity, "Scalars:scalars").items()}

    def cleared(self, entity: str) -> set[int | None]:
        """At which scans an entity is emptied."""
        return set(self.values(entity, CLEAR))

    def rows(self, entity: str, component: str) -> dict[int | None, bytes]:
        """Row of a component by the number of the scan; of one number, the later row counts."""
        return self._rows.get((entity, component), {})

    def _take(self, entity: str, batch: Any) -> None:
        named = {name: batch.column(name) for name in batch.schema.names}
        self.timelines |= {name for name in named if ":" not in name and "." not in name}
        rows = named[FRAME].to_pylist() if FRAME in named else [None] * batch.num_rows
        for row, number in enumerate(rows):
            if TIME in named:
                self.seconds[number] = named[TIME].cast("int64")[row].as_py() / 1e9
            for name, column in named.items():
                if ":" in name and column[row].is_valid:
                    value = column[row].values if name == POSITIONS else column[row].as_py()
                    self._values.setdefault((entity, name), {})[number] = value
                    self._rows.setdefault((entity, name), {})[number] = named[ROW][row].as_py()
