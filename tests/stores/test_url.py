"""URLs as paths and back, and none that leads out of its folder."""

from pathlib import Path

import pytest

from derain.errors import InputError
from derain.stores.url import is_url, path_of, paths_of, place_of, url_of, without_secrets


@pytest.mark.parametrize("url", ["s3://bucket", "s3://bucket/drives/a b.bin", "https://host/a.bin"])
def test_a_path_stands_for_each_url(url) -> None:
    path = path_of(url)
    assert not path.is_absolute()
    assert url_of(path) == url
    assert url_of(path / "more") == f"{url}/more"


@pytest.mark.parametrize("text", ["drives", "/drives", "C:/drives", "C:\\drives", "./a:b", "s3:/a"])
def test_paths_of_this_machine_are_no_urls(text) -> None:
    assert not is_url(text)
    assert place_of(text) == Path(text)


def test_what_works_in_folders_alone_refuses_urls() -> None:
    assert paths_of(["drives", Path("more")]) == [Path("drives"), Path("more")]
    with pytest.raises(InputError, match=r"s3://bucket/drives: is not on this machine"):
        paths_of(["drives", "s3://me:secret@bucket/drives"])
    with pytest.raises(InputError, match=r"s3://bucket/drives: is not on this machine"):
        paths_of([Path("s3://bucket/drives")])


@pytest.mark.parametrize("path", ["drives/a.bin", "/drives/s3:/a", "a:b/c"])
def test_paths_of_this_machine_are_named_as_they_are(path) -> None:
    assert url_of(Path(path)) == path


@pytest.mark.parametrize("key", ["../../etc/passwd", "a/../../b", "a/./b", "a//b"])
def test_keys_that_lead_elsewhere_are_refused(key) -> None:
    with pytest.raises(InputError, match="dots"):
        path_of(f"s3://bucket/{key}")


def test_no_secret_is_left_in_a_text() -> None:
    text = "see s3://me:secret@bucket/a@b.bin and https://host/a?sig=secret, not me@host"
    assert without_secrets(text) == "see s3://bucket/a@b.bin and https://host/a not me@host"
    quoted = without_secrets("no bucket me:secret@bucket", "s3://me:secret@bucket/a")
    assert quoted == "no bucket …@bucket"
