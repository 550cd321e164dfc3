"""derain takes the rain out of LiDAR and fused LiDAR + 4D-radar scans.

    import derain

    scan = derain.read_scan("scan.pcd")
    rain = derain.Derainer("model.onnx")(scan)
    derain.write_scan("clean.pcd", scan.take(~rain))

``import derain`` by itself loads none of what it offers, so that it stays quick and needs no torch:
a name is imported when it is first asked for. The names, and where each comes from, stand in one
table, the type stub ``__init__.pyi`` beside this file, which type checkers and editors read too.
"""

import sys
from importlib import import_module

__version__ = "0.2.0"


def _table() -> dict[str, str]:
    """The module that each name comes from, in the order of the type stub.

    Every line ``from module import name as name`` of the stub is one entry.
    """
    table = {}
    with open(f"{__path__[0]}/__init__.pyi", encoding="utf-8") as stub:
        for line in stub:
            match line.split():
                case ["from", module, "import", name, "as", _]:
                    table[name] = module
    return table


_MODULE_OF = _table()

__all__ = ["__version__", *_MODULE_OF]


def __getattr__(name: str) -> object:
    """Imports a name of the table when it is first asked for."""
    if name not in _MODULE_OF:
        # Given the name and the module, Python itself proposes a similar name in its message.
        raise AttributeError(
            f"module {__name__!r} has no attribute {name!r}", name=name, obj=sys.modules[__name__]
        )
    value: object = getattr(import_module(_MODULE_OF[name]), name)
    globals()[name] = value  # the next time Python finds it without asking here
    return value


def __dir__() -> list[str]:
    """What stands in this module, with the names that are not imported yet."""
    return sorted({*globals(), *_MODULE_OF})
