"""A registry finds what files and other packages bring, once somebody asks for it."""

import importlib
import sys
from collections.abc import Callable, Iterator, Sized
from concurrent.futures import ThreadPoolExecutor

import pytest

from derain.errors import InputError
from derain.export.runtimes.session import RUNTIMES, Session
from derain.files.format import FORMATS, Format
from derain.filters import FILTERS, PointFilter
from derain.models.base import DerainingModule
from derain.models.registry import NETWORKS
from derain.system.registry import Registry
from derain.views.view import VIEWS, View

Write = Callable[..., None]


@pytest.fixture
def write(tmp_path, monkeypatch) -> Iterator[Write]:
    """Writes modules of packages that can be imported for the length of a test."""
    before = set(sys.modules)
    monkeypatch.syspath_prepend(tmp_path)

    def write(name: str, content: str = "") -> None:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)
        importlib.invalidate_caches()

    yield write
    for name in set(sys.modules) - before:
        if name.startswith(("things", "foreign")):
            del sys.modules[name]


@pytest.fixture
def things(write) -> Registry[type]:
    """The registry of a package of two files, whose names are not in the order of their members."""
    write("things/first.py", member("pebble"))
    write("things/second.py", member("brick"))
    return registry(write, "'things'")


def registry(write: Write, arguments: str) -> Registry[type]:
    """The registry of a package, made with these arguments."""
    write("things/__init__.py")
    write(
        "things/registry.py",
        f"from derain.system.registry import Registry\nITEMS = Registry({arguments})",
    )
    made: Registry[type] = importlib.import_module("things.registry").ITEMS
    return made


def member(name: str) -> str:
    """What a module brings: ``ITEMS`` is the registry in the package's ``registry.py``."""
    return f"""
from things.registry import ITEMS

@ITEMS.add({name!r})
class {name.capitalize()}:
    pass
"""


def install(write: Write, name: str, content: str) -> None:
    """Writes a package of one module, with the entry point to it that an installed one leaves."""
    write(f"foreign_{name}.py", content)
    metadata = f"foreign_{name}-1.0.dist-info"
    write(f"{metadata}/METADATA", f"Name: foreign_{name}\nVersion: 1.0\n")
    write(f"{metadata}/entry_points.txt", f"[things]\n{name} = foreign_{name}\n")


def loaded() -> set[str]:
    return {name for name in sys.modules if name.startswith(("things.", "foreign"))}


def test_modules_are_imported_when_somebody_asks_and_other_packages_last(things, write) -> None:
    install(write, "cobble", member("cobble"))
    assert loaded() == {"things.registry"}
    assert "brick" in things  # its module is the second, and its name the first
    assert loaded() == {"things.registry", "things.first", "things.second"}
    assert things["cobble"].__module__ == "foreign_cobble"
    assert list(things) == ["brick", "cobble", "pebble"]


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("import nothing_of_this_name", "ModuleNotFoundError: No module named 'nothing_of_this_"),
        ("raise OSError('no\\nlicence')", r"OSError: no licence"),
        ("def broken(", "SyntaxError: "),
        ("raise SystemExit('bye')", "SystemExit: bye"),
        (member("brick"), "is the name of two entries, things.second.Brick and foreign_bad.Brick"),
    ],
)
def test_a_package_that_cannot_be_imported_is_warned_of_once_and_keeps_no_other_from_use(
    things, write, capsys, content, reason
) -> None:
    install(write, "bad", content)
    install(write, "good", member("cobble"))
    assert things["brick"].__module__ == "things.second"
    assert capsys.readouterr().err == ""  # derain's own are found without a look at others
    assert list(things) == ["brick", "cobble", "pebble"]
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("derain: warning: things: bad: foreign_bad cannot be imported (")
    assert reason in line
    assert line.endswith("Repair or uninstall the package foreign_bad.")
    with pytest.raises(KeyError):
        things["boulder"]
    assert capsys.readouterr().err == ""


def test_a_file_of_the_package_that_cannot_be_imported_is_an_error_every_time(
    things, write
) -> None:
    write("things/third.py", "import nothing_of_this_name")
    for _ in range(2):
        with pytest.raises(ModuleNotFoundError, match="nothing_of_this_name"):
            list(things)


def test_two_of_one_name_are_refused_and_both_are_named(things) -> None:
    assert "brick" in things
    both = rf"things: brick: .*, things\.second\.Brick and {__name__}\.Other\. Remove"
    with pytest.raises(InputError, match=both):
        things.add("cobble", "brick")(type("Other", (), {}))
    assert "cobble" not in things


def test_a_class_without_a_method_of_its_base_is_refused_and_the_method_is_named(things) -> None:
    sand = type("Sand", (Sized,), {})
    with pytest.raises(InputError, match=r"things: sand: .*Sand is without __len__"):
        things.add("sand")(sand)
    assert "sand" not in things


@pytest.mark.parametrize(
    ("registry", "base"),
    [
        (FILTERS, PointFilter),
        (FORMATS, Format),
        (NETWORKS, DerainingModule),
        (RUNTIMES, Session),
        (VIEWS, View),
    ],
)
def test_a_class_of_another_base_is_refused(registry, base) -> None:
    with pytest.raises(InputError, match=f"Sand is without the base class {base.__name__}"):
        registry.add("sand")(type("Sand", (), {}))
    assert "sand" not in registry


def test_one_member_may_have_several_names_and_answers_to_the_first(things) -> None:
    slab = type("Slab", (), {})
    assert things.add("slab", "plate")(slab) is slab
    assert things["slab"] is things["plate"] is slab
    assert slab.NAME == "slab"
    assert len(things) == 4


def test_a_module_that_is_imported_anew_brings_its_member_anew(things) -> None:
    former = things["brick"]
    importlib.reload(sys.modules["things.second"])
    assert things["brick"] is not former
    assert things["brick"].NAME == "brick"


def test_a_module_may_ask_what_there_is_while_it_is_imported(things, write) -> None:
    write("things/third.py", member("tile") + "\nKNOWN = list(ITEMS)")
    install(write, "cobble", member("cobble") + "\nKNOWN = list(ITEMS)")
    assert list(things) == ["brick", "cobble", "pebble", "tile"]
    assert "tile" in sys.modules["things.third"].KNOWN
    assert list(things) == sys.modules["foreign_cobble"].KNOWN


def test_entry_points_may_be_of_another_name_than_the_package(write) -> None:
    items = registry(write, "'things', 'things of all'")
    install(write, "cobble", member("cobble"))
    assert list(items) == []
    assert "foreign_cobble" not in loaded()


def test_a_thread_that_asks_while_another_imports_finds_all_that_there_is(things, write) -> None:
    install(write, "cobble", "import time; time.sleep(0.2)\n" + member("cobble"))
    with ThreadPoolExecutor(4) as threads:
        found = list(threads.map(lambda _: list(things), range(4)))
    assert found == 4 * [["brick", "cobble", "pebble"]]
