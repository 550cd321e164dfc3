"""Files that come with derain are named without a path, a user's own with one."""

from pathlib import Path

import pytest

from derain import InputError
from derain.files.documents import packaged_or_own


def test_a_name_or_a_path_is_a_file_and_anything_else_is_refused(tmp_path: Path) -> None:
    (own := tmp_path / "mine.yaml").touch()
    files = {"one": tmp_path / "one.yaml", "two": own}
    assert packaged_or_own("two", files, "sensor") == own
    assert packaged_or_own(own, files, "sensor") == own
    for name in ("three", tmp_path, tmp_path / "three.yaml", "one"):
        with pytest.raises(InputError, match=r"no such sensor\. .*a YAML file or one of one, "):
            packaged_or_own(name, files, "sensor")
