"""Imports OpenVINO, which is optional, and keeps it from telling anybody that it was."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from derain.system.extras import OPENVINO

TELEMETRY = "openvino_telemetry"


def import_openvino() -> Any:
    """Imports OpenVINO where it is needed; nothing else in derain imports it.

    Returns:
        The module openvino.

    Raises:
        MissingExtraError: OpenVINO is not installed.
        InputError: A library that it links against is missing.
    """
    with _without_telemetry():
        return OPENVINO.load("this runtime")


@contextmanager
def _without_telemetry() -> Iterator[None]:
    """Keeps the package openvino-telemetry from being imported meanwhile.

    OpenVINO depends on it and, with it in place, reports every import of itself over the network
    unless the user has opted out; without it OpenVINO is content with a stub. Whoever has imported
    it before has it back afterwards.

    Source: openvino/tools/ovc/__init__.py of OpenVINO 2026.4.1, which sends "general_import".
    """
    former = {name: module for name, module in sys.modules.items() if _is_telemetry(name)}
    for name in former:
        del sys.modules[name]
    sys.modules[TELEMETRY] = None  # type: ignore[assignment]  # importing it is an ImportError
    try:
        yield
    finally:
        del sys.modules[TELEMETRY]
        sys.modules.update(former)


def _is_telemetry(name: str) -> bool:
    return name == TELEMETRY or name.startswith(f"{TELEMETRY}.")
