"""Fixtures of the simulation's tests."""

from types import ModuleType

import pytest

from derain.errors import InputError
from derain.system.open3d_import import import_open3d


@pytest.fixture(scope="session")
def open3d() -> ModuleType:
    """Open3D; tests that ray-cast skip where it cannot be imported."""
    try:
        return import_open3d()
    except InputError as error:
        pytest.skip(str(error))
