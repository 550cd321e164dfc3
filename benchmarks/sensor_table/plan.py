"""The plan of a table across sensors, read from its YAML file."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml


@dataclass(frozen=True)
class Row:
    """A row: a method, named by its file or settings.

    Attributes:
        method: As ``derain bench`` has it: a model, a YAML of parameters, a filter, a baseline.
        set: Parameters of a filter, by name.
        weights: A published state_dict of 3D-OutDet in place of a method, below the shared folder.
        card: Data card by whose statistics these weights normalise.
        learnt_from: Columns of scans that it was trained on, as far as no record names them.
    """

    method: str = ""
    set: Mapping[str, Any] = field(default_factory=dict)
    weights: str = ""
    card: str = "wads"
    learnt_from: tuple[str, ...] = ()

    @property
    def is_position(self) -> bool:
        """True if it is learnt anew for each column, from other scans of the same data."""
        return self.method == "position"


@dataclass(frozen=True)
class LabelledData:
    """Columns of labelled scans: IoU of rain, or the share that is taken of what is no rain.

    Attributes:
        scans: Files and folders below the shared folder; the root of a data set gives its test
            part.
        simulate: Options of ``derain simulate`` that make them, in place of scans.
        card: Data card of their labels; None: by the folders' names.
        position: Other scans of the same data, from which places are learnt; by default the
            training part of what was simulated.
        taken: Classes of which the share that is called rain is shown in place of the IoU, for
            scans without rain.
    """

    scans: tuple[str, ...] = ()
    simulate: str = ""
    card: str | None = None
    position: tuple[str, ...] = ()
    taken: tuple[str, ...] = ()


@dataclass(frozen=True)
class Plan:
    """The rows and columns.

    Attributes:
        methods: The rows, by title.
        labelled: Data with labels, by title.
        clean: Folders of scans without rain and without labels, below the shared folder: a column
            a scan.
        timed: Title of the labelled data whose first scan methods are timed on.
    """

    methods: Mapping[str, Row]
    labelled: Mapping[str, LabelledData]
    clean: tuple[str, ...]
    timed: str

    @classmethod
    def of_yaml(cls, path: Path) -> "Plan":
        """Reads a plan."""
        content = yaml.safe_load(path.read_text("utf-8"))
        return cls(
            {
                title: Row(method) if isinstance(method, str) else Row(**_tuples(method))
                for title, method in content["methods"].items()
            },
            {title: LabelledData(**_tuples(data)) for title, data in content["labelled"].items()},
            tuple(content.get("clean", ())),
            content["timed"],
        )

    def with_methods(self, methods: Mapping[str, Row]) -> "Plan":
        """The same plan with further rows above the others; one of the same title is replaced."""
        others = {title: row for title, row in self.methods.items() if title not in methods}
        return self.with_only({**methods, **others})

    def with_only(self, methods: Mapping[str, Row]) -> "Plan":
        """The same columns, of these methods alone."""
        return replace(self, methods=methods)

    def with_data(self, titles: Collection[str]) -> "Plan":
        """The same rows, of these labelled data and no other scans."""
        chosen = {title: data for title, data in self.labelled.items() if title in titles}
        return replace(self, labelled=chosen, clean=())


def _tuples(described: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in described.items()
    }
