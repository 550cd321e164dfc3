"""Label files: class in the low half, instance in the high half."""

import os

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from derain import InputError
from derain.files.labels import instance, read_labels, write_labels
from derain.scan import class_ids


def test_halves_lie_where_semantickitti_puts_them(tmp_path) -> None:
    path = tmp_path / "scan.label"
    path.write_bytes(bytes([110, 0, 7, 0, 0xFC, 0x00, 0x01, 0x02]))
    raw = read_labels(path, points=2)
    assert class_ids(raw).tolist() == [110, 252]
    assert instance(raw).tolist() == [7, 0x0201]
    assert class_ids(raw).dtype == instance(raw).dtype == np.int64


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(raw=arrays(np.uint32, st.integers(0, 20)))
def test_both_halves_come_back(tmp_path, raw) -> None:
    path = tmp_path / "scan.label"
    write_labels(path, class_ids(raw), instance(raw))
    assert path.read_bytes() == raw.astype("<u4").tobytes()
    np.testing.assert_array_equal(read_labels(path, len(raw)), raw)


@pytest.mark.parametrize(
    ("size", "found"), [(8, "2"), (16, "4"), (13, "3.25"), (0, "0"), (2**42, r"1\.09951e\+12")]
)
def test_labels_of_another_length_are_refused_unread_with_both_numbers(
    tmp_path, size, found
) -> None:
    path = tmp_path / "scan.label"
    path.touch()
    os.truncate(path, size)
    with pytest.raises(InputError, match=rf"holds {found} labels .* for a scan of 3 points"):
        read_labels(path, points=3)


@pytest.mark.parametrize("label", [-1, 65536])
def test_an_id_that_needs_more_than_16_bits_is_not_written(tmp_path, label) -> None:
    ids = np.array([0, label])
    for halves in ((ids, None), (np.zeros(2, np.int64), ids)):
        with pytest.raises(InputError, match="outside 0 to 65535"):
            write_labels(tmp_path / "scan.label", *halves)
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_the_reason_that_is_named(tmp_path, full_disk) -> None:
    full_disk()
    with pytest.raises(InputError, match=r"scan\.label: cannot be written \(File too large\)"):
        write_labels(tmp_path / "scan.label", np.zeros(20_000, int))
    assert list(tmp_path.iterdir()) == []
