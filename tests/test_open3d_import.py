"""Open3D is imported, or the user is told what is missing."""

import sys

import pytest

from derain.errors import InputError
from derain.open3d_import import import_open3d


def test_a_missing_open3d_is_reported_with_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "open3d", None)
    with pytest.raises(InputError, match=r"open3d: cannot be imported \(.*\)\. Install"):
        import_open3d()
