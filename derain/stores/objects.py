"""Objects of stores: listed, copied to this machine, and written, by fsspec.

Stores fail now and then, by refusing requests that come too fast or by breaking a connection off:
each request is tried several times, with growing waits, and the size of a copy is compared with the
listing.
"""

import errno
import random
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from tempfile import gettempdir
from typing import Any, TypeVar

from derain.errors import InputError, reason_of
from derain.stores.url import is_web, path_of, without_secrets
from derain.system.extras import FSSPEC

# Seconds between the tries of a request; each wait is drawn between half of it and all.
WAITS = (0.5, 1.0, 2.0, 4.0, 8.0)

# Requests at once: most of a request for a scan is waiting.
AT_ONCE = 16

# What a listing may have that changes with the content of an object, the surest first.
VERSIONS = (
    "ETag",
    "etag",
    "md5Hash",
    "Last-Modified",
    "LastModified",
    "updated",
    "mtime",
    "created",
)

# Errors that the next try would meet again; and those of botocore that are so, or that refuse
# access, by their names, for it may not be installed.
FINAL = (IsADirectoryError, NotImplementedError)
WRONG_PARAMETERS = "ParamValidationError"
REFUSALS = ("NoCredentialsError", "PartialCredentialsError", "ProfileNotFound")

# The status of an answer of a web server after which another request may succeed.
TOO_MANY_REQUESTS = 429

Result = TypeVar("Result")


@dataclass(frozen=True)
class StoredObject:
    """An object as its store lists it.

    Attributes:
        url: Its URL, which may hold a signature.
        size: Bytes; None if the store does not list them.
        version: Changes when its content does.
    """

    url: str
    size: int | None
    version: str

    @property
    def path(self) -> Path:
        """The path that stands for its URL."""
        return path_of(self.url)

    @property
    def stamp(self) -> str:
        """Its size and version: what changes when its content does."""
        return f"{self.size}-{self.version}"


def listed(url: str) -> list[StoredObject]:
    """The object at a URL, or the objects below it.

    Args:
        url: An object or a folder. On web servers, which list a folder as a page of links, the URL
            of a folder ends with a slash.

    Raises:
        InputError: There is none, or the store cannot be reached.
    """
    found = _found(url)
    if not found:
        raise _missing(url)
    return found


def stamps_at(url: str) -> dict[str, str]:
    """Sizes and versions of the objects below a URL, by path, in one listing.

    Raises:
        InputError: The store cannot be reached.
    """
    return {str(each.path): each.stamp for each in _found(url)}


def fetch(objects: Mapping[Path, StoredObject]) -> None:
    """Copies objects to this machine, several at once.

    Args:
        objects: The objects by the files that they are copied to, whose folders are made.

    Raises:
        InputError: One of them cannot be read, or has not the size that was listed.
    """
    for folder in {file.parent for file in objects}:
        folder.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(AT_ONCE) as pool:
        for _ in pool.map(_fetch, objects, objects.values()):
            pass


def upload(folder: Path, url: str) -> dict[str, str]:
    """Writes the files of a folder to a store, several at once; each appears when it is complete.

    Args:
        folder: The folder.
        url: URL of the folder in the store.

    Returns:
        Sizes and versions of the objects, by path.

    Raises:
        InputError: One of them cannot be written.
    """
    filesystem, path = opened(url)

    def put(file: Path) -> StoredObject:
        relative = file.relative_to(folder).as_posix()
        key = f"{path.rstrip('/')}/{relative}"
        tried(f"{url}/{relative}", lambda: filesystem.put_file(str(file), key))
        return _object(filesystem, tried(f"{url}/{relative}", lambda: filesystem.info(key)))

    files = [file for file in folder.rglob("*") if file.is_file()]
    with ThreadPoolExecutor(AT_ONCE) as pool:
        return {str(stored.path): stored.stamp for stored in pool.map(put, files)}


def tried(url: str, request: Callable[[], Result]) -> Result:
    """The result of a request, which is tried several times.

    Args:
        url: Subject of the message.
        request: Makes the request.

    Raises:
        InputError: Every try failed, or the first in a way that the next would, too.
    """
    for wait in (*WAITS, None):
        try:
            return request()
        except Exception as error:  # each library of a store raises its own kinds
            # From None: what the library's error holds may be secret.
            if refusal := _refusal(url, error):
                raise refusal from None
            if wait is None:
                raise _failed(url, error, f" {len(WAITS) + 1} times") from None
            time.sleep(wait * random.uniform(0.5, 1))
    raise AssertionError("the last try has no wait")


def opened(url: str) -> tuple[Any, str]:
    """The file system of a store, of fsspec, and the path of an object or a folder in it.

    Raises:
        InputError: No such store, or a library is missing.
    """
    fsspec = FSSPEC.load(without_secrets(url), "core")
    try:
        # Nothing is remembered of a listing: others write there, too.
        filesystem, path = fsspec.url_to_fs(url, use_listings_cache=False)
    except ImportError as error:
        raise InputError(
            without_secrets(url),
            f"needs a library that is not installed ({reason_of(error)})",
            "Install it with pip: s3fs for s3://, gcsfs for gs://.",
        ) from None
    except ValueError as error:
        raise InputError(
            without_secrets(url),
            f"names no store that is known ({without_secrets(reason_of(error))})",
            "Give a URL such as s3://bucket/folder.",
        ) from None
    except OSError as error:  # some connect at once
        raise _failed(url, error) from None
    return filesystem, path


def _found(url: str) -> list[StoredObject]:
    """The object at a URL, or those below it; an empty list if there is nothing."""
    filesystem, path = opened(url)
    entries = tried(url, lambda: _entries(filesystem, url, path))
    return [_object(filesystem, entry) for entry in entries]


def _entries(filesystem: Any, url: str, path: str) -> list[dict[str, Any]]:
    if is_web(url) and not without_secrets(url).endswith("/"):
        return [filesystem.info(path)]
    found = filesystem.find(path, detail=True).values()
    files = [entry for entry in found if entry["type"] == "file" and entry["name"][-1] != "/"]
    return [filesystem.info(entry["name"]) for entry in files] if is_web(url) else files


def _object(filesystem: Any, entry: Mapping[str, Any]) -> StoredObject:
    url = filesystem.unstrip_protocol(entry["name"])
    # Some stores quote an ETag in a listing and not elsewhere.
    versions = (str(entry[name]).strip('"') for name in VERSIONS if entry.get(name) is not None)
    return StoredObject(url, entry.get("size"), next(versions, ""))


def _fetch(file: Path, stored: StoredObject) -> None:
    filesystem, key = opened(stored.url)

    def get() -> None:
        filesystem.get_file(key, str(file))
        size = file.stat().st_size
        if stored.size is not None and size != stored.size:
            raise OSError(f"{size:,} bytes arrived of the {stored.size:,} listed")

    tried(stored.url, get)


def _refusal(url: str, error: Exception) -> InputError | None:
    """The error of a request that would fail again; None for one that may succeed next time."""
    if isinstance(error, InputError):
        return error
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        return InputError(
            without_secrets(url),
            f"there is no room for a copy in {gettempdir()}",
            "Free space there, or name another folder in TMPDIR.",
        )
    if isinstance(error, FileNotFoundError):
        return _missing(url) if not is_web(url) or _is_missing(error) else None
    if isinstance(error, PermissionError) or type(error).__name__ in REFUSALS:
        return InputError(
            without_secrets(url),
            f"the store refuses access ({_reason(url, error)})",
            "Check the credentials that its library finds in the environment.",
        )
    is_final = isinstance(error, FINAL) or type(error).__name__ == WRONG_PARAMETERS
    return _failed(url, error) if is_final else None


def _is_missing(error: FileNotFoundError) -> bool:
    """True if a web server has no such file; fsspec raises the same where none answers."""
    status = getattr(error.__cause__, "status", 404 if error.__cause__ is None else 0)
    return 400 <= status < 500 and status != TOO_MANY_REQUESTS


def _missing(url: str) -> InputError:
    return InputError(without_secrets(url), "there is no such object or folder", "Check the URL.")


def _failed(url: str, error: Exception, tries: str = "") -> InputError:
    return InputError(
        without_secrets(url),
        f"a request failed{tries} ({_reason(url, error)})",
        "Check the store, then run the same command again.",
    )


def _reason(url: str, error: Exception) -> str:
    if isinstance(error, FileNotFoundError) and isinstance(error.__cause__, Exception):
        error = error.__cause__
    return without_secrets(f"{type(error).__name__}: {reason_of(error)}", url)
