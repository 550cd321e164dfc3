"""What there is of one kind, by name: a file enters by being there."""

import sys
from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from inspect import isabstract
from pkgutil import iter_modules
from threading import RLock
from typing import TYPE_CHECKING, Generic, TypeVar, cast

from derain.errors import InputError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

Kind = TypeVar("Kind")
Member = TypeVar("Member")


class Registry(Mapping[str, Kind], Generic[Kind]):
    """Everything of one kind: what the files of a package bring, and what other packages bring.

    A file adds to it by a decorator::

        @FILTERS.add("dror")
        class DROR(RadiusFilter): ...

    The files are imported when somebody asks for a name that is not known yet, or what there is. A
    package outside derain names the module of its own among the entry points of the same name::

        [project.entry-points."derain.filters"]
        mine = "my_package.my_filter"

    That module is imported when derain's own files do not have the name that is asked for, or when
    somebody asks what there is. One that cannot be imported is warned of and brings nothing, and
    the others stay usable. The names come in alphabetical order, whatever was imported first.

    Args:
        package: Package whose modules bring members, such as ``derain.filters``.
        group: Name of the entry points of other packages; by default the package's.
        attribute: Attribute of a member that is set to the first of its names, so that it knows
            what it is called; by default none is.
    """

    def __init__(
        self, package: str, group: str | None = None, attribute: str | None = None
    ) -> None:
        self.package = package
        self.group = group or package
        self.attribute = attribute
        self._members: dict[str, Kind] = {}
        self._has_own = False
        self._has_others = False
        # Re-entrant, for a module of another package may ask what there is while it is imported.
        self._importing_others = RLock()

    def add(self, *names: str) -> Callable[[Member], Member]:
        """Decorates a member, which is then found by these names.

        Raises:
            InputError: A name that another member has, or a class that leaves out a method which
                its base class asks for.
        """

        def added(member: Member) -> Member:
            if isabstract(member):
                missing = ", ".join(sorted(getattr(member, "__abstractmethods__", ())))
                raise InputError(
                    f"{self.group}: {names[0]}",
                    f"{_origin(member)} is without {missing}",
                    "Its base class says what every method does: define it.",
                )
            for name in names:
                former = _origin(self._members.get(name, member))
                if former != _origin(member):
                    raise InputError(
                        f"{self.group}: {name}",
                        f"two are called so, {former} and {_origin(member)}",
                        "Remove or rename one.",
                    )
            # Where a module was imported anew, its members take the place of the former ones.
            self._members.update(dict.fromkeys(names, cast(Kind, member)))
            if self.attribute:
                setattr(member, self.attribute, names[0])
            return member

        return added

    def name_of(self, member: object) -> str | None:
        """The first of the names that a member was added by; None for what was not added."""
        return next((name for name, added in self._members.items() if added is member), None)

    def __getitem__(self, name: str) -> Kind:
        # Other packages come last: to look for them takes longer than to import derain's files.
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
        """Imports what other packages bring, once; warns of what cannot be imported.

        A thread that asks while another imports waits for it, and finds all that there is.
        """
        with self._importing_others:
            if self._has_others:
                return
            self._has_others = True  # before, for one of them may ask what there is
            # Imported here, for most commands never ask other packages.
            from importlib.metadata import entry_points

            for entry in sorted(entry_points(group=self.group), key=lambda entry: entry.name):
                try:
                    entry.load()
                except Exception as error:  # whatever the code of others raises
                    self._forget_unfinished()
                    _warn_of_broken(entry, error)

    def _forget_unfinished(self) -> None:
        """Lets go of what a module has added before it failed, which no other process could load.

        Python takes a module that fails from those that are imported.
        """
        for name, member in list(self._members.items()):
            if getattr(member, "__module__", None) not in (None, *sys.modules):
                del self._members[name]


def _warn_of_broken(entry: "EntryPoint", error: Exception) -> None:
    """Says of another package that what it brings cannot be imported."""
    from derain.system.notices import warn  # here: it brings progress bars with it

    package = entry.dist.name if entry.dist else "that brings it"
    problem = InputError(
        f"{entry.group}: {entry.name}",
        f"{entry.value} cannot be imported ({type(error).__name__}: {error})",
        f"Repair or uninstall the package {package}.",
    )
    warn(str(problem))


def _origin(member: object) -> str:
    """Where a member is defined: the same when its module is imported anew."""
    name = getattr(member, "__qualname__", None)
    return repr(member) if name is None else f"{member.__module__}.{name}"
