"""The manifest of a simulated data set: recognised, and refused where it is damaged."""

import pytest

from derain.errors import InputError
from derain.files.documents import shown
from derain.simulation.campaign import Campaign
from derain.simulation.manifest import MAKER, read_manifest, write_manifest


def test_a_manifest_comes_back(tmp_path) -> None:
    files = {f"sequences/{n // 500:03d}/velodyne/{n:06d}.bin": 64 * "0" for n in range(20_000)}
    content = {**Campaign().description, "files": files}
    write_manifest(tmp_path, content)
    assert read_manifest(tmp_path) == content


@pytest.mark.parametrize(
    "text",
    [
        *("", "{", "[]", "null", "[" * 100_000, "\xff"),
        '{"made_by": "somebody else", "split": 5}',
        '{"made_by": "derain.simulation", "campaign": ' + f"{40 * '['}{40 * ']'}}}",
    ],
    ids=shown,
)
def test_what_derain_did_not_write_is_no_manifest_of_its(tmp_path, text) -> None:
    assert read_manifest(tmp_path) == {}
    (tmp_path / "manifest.json").write_text(text, "latin-1")
    assert read_manifest(tmp_path) == {}


@pytest.mark.parametrize(
    ("key", "value", "where"),
    [
        ("split", ["000"], "split"),
        ("split", {"train": ["000"], "test": ["001"]}, "split"),
        ("split", {"train": "000", "validation": [], "test": []}, "split.train"),
        ("split", {"train": [[]], "validation": [], "test": []}, "split.train[0]"),
        ("rain_rate_mm_h", [10], "rain_rate_mm_h"),
        ("rain_rate_mm_h", {"000": [10]}, "rain_rate_mm_h.000"),
        ("rain_rate_mm_h", {"000": -1}, "rain_rate_mm_h.000"),
        ("rain_rate_mm_h", {"000": 10**400}, "rain_rate_mm_h.000"),
        ("files", None, "files"),
        ("files", {"a": 1}, "files.a"),
    ],
)
def test_a_manifest_with_a_value_of_another_kind_is_refused(tmp_path, key, value, where) -> None:
    write_manifest(tmp_path, {"made_by": MAKER, key: value})
    with pytest.raises(InputError) as refusal:
        read_manifest(tmp_path)
    assert refusal.value.subject == f"{tmp_path / 'manifest.json'}: {where}"
    assert len(str(refusal.value)) < len(str(tmp_path)) + 300
