"""derain takes the rain out of LiDAR and fused LiDAR + 4D-radar scans.

    import derain

    scan = derain.read_scan("scan.pcd")
    rain = derain.Derainer("model.onnx")(scan)
    derain.write_scan("clean.pcd", scan.take(~rain))

``import derain`` loads no submodule, so that it is fast and needs no torch: each name is imported
at its first use. The type stub ``__init__.pyi`` beside this file lists the names and their modules;
type checkers and editors read it too.

Names for training need ``pip install 'derain[train]'``. Without it they raise an ``ImportError``
with this command, and ``dir(derain)`` omits them.
"""

import sys
from importlib import import_module
from importlib.util import find_spec

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

# Packages whose modules train networks, and the libraries that they need.
_TRAINING = (
    *("derain.models.", "derain.datamodules."),
    *("derain.workflows.fit", "derain.workflows.learn"),
)
_TORCH = "torch"


def __getattr__(name: str) -> object:
    """Imports a name of the table at its first use."""
    if name == "__all__":
        return ["__version__", *_importable()]
    if name not in _MODULE_OF:
        # Given the name and the module, Python itself proposes a similar name in its message.
        raise AttributeError(
            f"module {__name__!r} has no attribute {name!r}", name=name, obj=sys.modules[__name__]
        )
    try:
        value: object = getattr(import_module(_MODULE_OF[name]), name)
    except ModuleNotFoundError as error:
        from derain.system.extras import missing_extra

        missing = missing_extra(f"derain.{name}", error)
        if missing is None:
            raise
        raise missing from error
    globals()[name] = value  # the next time Python finds it without asking here
    return value


def __dir__() -> list[str]:
    """Names of this module, including those that are not imported yet."""
    return sorted({*globals(), "__all__", *_importable()})


def _importable() -> list[str]:
    """The names of the table, those that train networks only where they can be imported."""
    if find_spec(_TORCH) is not None:
        return [*_MODULE_OF]
    return [name for name, module in _MODULE_OF.items() if not module.startswith(_TRAINING)]
