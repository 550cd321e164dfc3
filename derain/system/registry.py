"""Members of one kind by name, such as filters, and what a user's parameters make of them."""

from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from inspect import signature
from pkgutil import iter_modules
from threading import RLock
from typing import Any, Generic, TypeVar, cast

from derain.errors import InputError, did_you_mean

Kind = TypeVar("Kind")
Member = TypeVar("Member")
Made = TypeVar("Made")


class Registry(Mapping[str, Kind], Generic[Kind]):
    """Classes of one kind: those in the modules of a package, and those of other packages.

    A module adds a member by a decorator::

        @FILTERS.add("dror")
        class DROR(RadiusFilter): ...

    The modules are imported when an unknown name is looked up, or the names are listed. A package
    outside derain names its module among the entry points of the same name::

        [project.entry-points."derain.filters"]
        mine = "my_package.my_filter"

    That module is imported when derain's own modules do not have a name, or when the names are
    listed. One that cannot be imported causes a warning; the others stay usable.
    The names are in alphabetical order. The first name of a member is its attribute ``NAME``.

    Args:
        package: Package whose modules add members, such as ``derain.filters``.
        group: Name of the entry points of other packages; by default the package's.
        base: Name of the base class of every member.
    """

    def __init__(self, package: str, group: str | None = None, base: str = "object") -> None:
        self.package = package
        self.group = group or package
        self.base = base
        self._members: dict[str, Kind] = {}
        self._has_own = False
        self._has_others = False
        self._importing = RLock()

    def add(self, *names: str) -> Callable[[Member], Member]:
        """Decorates a member, which gets these names.

        Raises:
            InputError: A name that another member has, or a member that is no subclass of the base
                class or lacks one of its methods.
        """

        def added(member: Member) -> Member:
            missing = ", ".join(sorted(getattr(member, "__abstractmethods__", ())))
            if self.base not in [kind.__name__ for kind in getattr(member, "__mro__", ())]:
                missing = f"the base class {self.base}"
            if missing:
                raise InputError(
                    f"{self.group}: {names[0]}",
                    f"{_origin(member)} is without {missing}",
                    f"Define the class as {self.base} describes.",
                )
            for name in names:
                former = _origin(self._members.get(name, member))
                if former != _origin(member):
                    raise InputError(
                        f"{self.group}: {name}",
                        f"is the name of two entries, {former} and {_origin(member)}",
                        "Remove or rename one.",
                    )
            # Members of a module that was imported again replace the former ones.
            self._members.update(dict.fromkeys(names, cast(Kind, member)))
            member.NAME = names[0]  # type: ignore[attr-defined]
            return member

        return added

    def __getitem__(self, name: str) -> Kind:
        # Other packages come last: to look for them takes longer than to import derain's modules.
        for import_more in (self._import_own, self._import_others):
            if name not in self._members:
                import_more()
        return self._members[name]

    def __iter__(self) -> Iterator[str]:
        self._import_own()
        self._import_others()
        return iter(sorted(self._members))

    def __len__(self) -> int:
        return len(list(iter(self)))

    def _import_own(self) -> None:
        """Imports the modules of the package, once."""
        if self._has_own:
            return
        package = import_module(self.package)
        for module in iter_modules(package.__path__):
            import_module(f"{self.package}.{module.name}")
        self._has_own = True

    def _import_others(self) -> None:
        """Imports the modules of other packages, once; warns of those that cannot be imported."""
        with self._importing:  # another thread waits until all are there
            if not self._has_others:
                self._has_others = True  # first, because one of them may list the names
                self._load_entry_points()

    def _load_entry_points(self) -> None:
        # Imported here, because most commands never need other packages.
        from importlib.metadata import entry_points

        for entry in sorted(entry_points(group=self.group), key=lambda entry: entry.name):
            try:
                entry.load()
            except (Exception, SystemExit) as error:  # whatever the code of others raises
                from derain.system.notices import warn  # here, because it imports tqdm

                package = entry.dist.name if entry.dist else "that brings it"
                problem = InputError(
                    f"{entry.group}: {entry.name}",
                    f"{entry.value} cannot be imported ({type(error).__name__}: {error})",
                    f"Repair or uninstall the package {package}.",
                )
                warn(str(problem))


def from_parameters(kind: Callable[..., Made], name: str, parameters: Mapping[str, Any]) -> Made:
    """Makes a dataclass from parameters that a user names.

    Args:
        kind: The dataclass, which checks the values itself.
        name: The user's name for it.
        parameters: Some of its fields.

    Raises:
        InputError: A parameter that is no field of it, or a value that it refuses.
    """
    known = list(signature(kind).parameters)
    if unknown := sorted(set(parameters) - set(known)):
        raise InputError(
            name,
            f"it has no parameter {', '.join(unknown)}",
            f"{did_you_mean(unknown[0], known)}It has {', '.join(known)}.",
        )
    return kind(**parameters)


def _origin(member: Any) -> str:
    """The module and name of a member, which stay the same when its module is imported again."""
    return f"{member.__module__}.{member.__qualname__}"
