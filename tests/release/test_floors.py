"""The lowest versions are those that pyproject.toml states."""

import pytest

from release.floors import floors


def test_plain_derain_has_a_floor_for_each_dependency() -> None:
    names = {line.partition("==")[0] for line in floors()}
    assert names == {"numpy", "onnxruntime", "small-gicp", "pyyaml", "tqdm", "python-neo-lzf"}
    assert "numpy==2.3" in floors()


def test_an_extra_that_is_made_of_others_has_theirs() -> None:
    of_all = floors(["all"])
    assert set(of_all) > {*floors(["train"]), *floors(["feather"])} > {*floors()}
    assert len(of_all) == len(set(of_all))
    assert not [line for line in of_all if line.startswith("derain")]


def test_an_extra_that_there_is_not_is_refused() -> None:
    with pytest.raises(KeyError):
        floors(["rain"])
