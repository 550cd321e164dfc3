"""Objects come whole or not at all, however often their store fails, and secrets stay secret."""

from pathlib import Path

import pytest

from derain.errors import InputError
from derain.stores import objects
from derain.stores.objects import StoredObject, fetch, listed, upload

URL = "failing://bucket/drives"


def test_what_is_uploaded_is_listed_and_fetched_though_requests_fail(store, tmp_path) -> None:
    store.faults.refuse, store.faults.cut = 4, 3
    written = {Path(f"{number % 2}/{number}.bin"): bytes([number]) * 9 for number in range(20)}
    for file, content in written.items():
        (tmp_path / "in" / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "in" / file).write_bytes(content)
    upload(tmp_path / "in", URL)
    stored = listed(URL)
    fetch({tmp_path / "out" / each.path: each for each in stored})
    for file, content in written.items():
        assert (tmp_path / "out/failing:/bucket/drives" / file).read_bytes() == content
    assert [each.size for each in stored] == [9] * 20
    assert store.faults.requests > 50


def test_a_change_of_an_object_changes_its_version(store) -> None:
    store.pipe(f"{URL}/a.bin", b"one")
    (before,) = listed(URL)
    store.pipe(f"{URL}/a.bin", b"two")
    (after,) = listed(URL)
    assert before.size == after.size
    assert before.version != after.version


def test_a_read_that_never_comes_whole_is_an_error_with_both_sizes(store, tmp_path) -> None:
    store.pipe(f"{URL}/a.bin", b"12345")
    store.faults.cut = 1
    (stored,) = listed(f"{URL}/a.bin")
    with pytest.raises(InputError, match="1 bytes arrived of the 5") as caught:
        fetch({tmp_path / "a.bin": stored})
    assert caught.value.subject == f"{URL}/a.bin"
    assert store.faults.reads == len(objects.WAITS) + 1


def test_what_is_not_there_is_not_asked_for_again(store, tmp_path) -> None:
    with pytest.raises(InputError, match="no such object"):
        listed(URL)
    with pytest.raises(InputError, match="no such object"):
        fetch({tmp_path / "a.bin": StoredObject(f"{URL}/a.bin", 1, "")})
    assert store.faults.requests == 1


@pytest.mark.parametrize("scheme", ["failing", "nothing", "gs"])
def test_errors_name_no_secrets(store, scheme) -> None:
    with pytest.raises(InputError) as caught:
        listed(f"{scheme}://me:pass-word@bucket/drives/a.bin?signature=sec-ret")
    for secret in ("me:", "pass-word", "sec-ret"):
        assert secret not in str(caught.value)
    assert caught.value.subject == f"{scheme}://bucket/drives/a.bin"
