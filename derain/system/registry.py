"""What there is of one kind, by name: a file enters by being there."""

from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from importlib.metadata import entry_points
from pkgutil import iter_modules
from typing import Generic, TypeVar

from derain.errors import InputError

Kind = TypeVar("Kind")
Member = TypeVar("Member")


class Registry(Mapping[str, Kind], Generic[Kind]):
    """Everything of one kind: what the files of a package bring, and what other packages bring.

    A file adds to it by a decorator::

        @FILTERS.add("dror")
        class DROR(RadiusFilter): ...

    The files are imported when somebody asks what there is. A package outside derain names the
    module of its own under the entry points of the same name, and is imported then as well::

        [project.entry-points."derain.filters"]
        mine = "my_package.my_filter"

    Args:
        package: Package whose modules bring members, such as ``derain.filters``.
        group: Name of the entry points of other packages; by default the package's.
    """

    def __init__(self, package: str, group: str | None = None) -> None:
        self.package = package
        self.group = group or package
        self._members: dict[str, Kind] = {}
        self._complete = False

    def add(self, *names: str) -> Callable[[Member], Member]:
        """Decorates a member, which is then found by these names.

        Raises:
            InputError: A name that another member has.
        """

        def added(member: Member) -> Member:
            for name in names:
                # A module that is imported twice brings the same once more.
                if repr(self._members.setdefault(name, member)) != repr(member):  # type: ignore[arg-type]
                    raise InputError(
                        f"{self.group}: {name}", "two are called so", "Remove or rename one."
                    )
            return member

        return added

    def __getitem__(self, name: str) -> Kind:
        if name not in self._members:
            self._complete_it()
        return self._members[name]

    def __iter__(self) -> Iterator[str]:
        self._complete_it()
        return iter(sorted(self._members))

    def __len__(self) -> int:
        self._complete_it()
        return len(self._members)

    def _complete_it(self) -> None:
        """Imports what brings members, once.

        Raises:
            InputError: A package outside derain that cannot be imported.
        """
        if self._complete:
            return
        self._complete = True
        package = import_module(self.package)
        for module in iter_modules(package.__path__):
            import_module(f"{self.package}.{module.name}")
        for entry in entry_points(group=self.group):
            try:
                entry.load()
            except Exception as error:  # whatever a foreign module raises
                raise InputError(
                    f"{entry.group}: {entry.name}",
                    f"{entry.value} cannot be loaded ({error})",
                    f"Repair or uninstall the package {entry.dist.name if entry.dist else ''}.",
                ) from error
