"""URLs of object stores: as a user writes them, as messages show them, and as paths."""

import re
from collections.abc import Iterable
from pathlib import Path

from derain.errors import InputError

# A folder or a file: a path on this machine, or a URL.
Place = Path | str

# Two letters at least: one is a drive of Windows.
SCHEME = r"[A-Za-z][A-Za-z0-9+.-]+"


def is_url(place: Place | None) -> bool:
    """True if a place is a URL such as ``s3://bucket/drives``."""
    return isinstance(place, str) and re.match(f"{SCHEME}://", place) is not None


def is_web(place: Place) -> bool:
    """True if a place is on a web server, which is read and not written."""
    return isinstance(place, str) and place.startswith(("http://", "https://"))


def place_of(text: str) -> Place:
    """The place that a user names: a URL as text, anything else as a path."""
    return text if is_url(text) else Path(text)


def paths_of(places: Iterable[Place]) -> list[Path]:
    """Places that are all on this machine.

    Raises:
        InputError: One of them is a URL.
    """
    paths = []
    for place in places:
        path = Path(place)
        url = url_of(path)  # also of a path that was made of one
        if is_url(url) and not path.exists():
            raise InputError(
                without_secrets(url), "is not on this machine", "Copy it to a folder first."
            )
        paths.append(path)
    return paths


def without_secrets(text: str, url: str = "") -> str:
    """A text in which no URL has a user, a password or a query: signatures are in queries.

    Args:
        text: The text.
        url: One whose user and password the text may have without the rest of it.
    """
    for user in re.findall(f"{SCHEME}://([^/\\s@]*@)", url):
        text = text.replace(user, "…@")
    without_users = re.sub(rf"({SCHEME}://)[^/\s@]*@", r"\1", text)
    return re.sub(rf"({SCHEME}://[^\s?]*)\?\S*", r"\1", without_users)


def path_of(url: str) -> Path:
    """The relative path that represents a URL, such as ``s3:/bucket/drives``; nothing lies there.

    Raises:
        InputError: A part of the URL would lead out of its folder.
    """
    scheme, _, rest = without_secrets(url).partition("://")
    parts = rest.strip("/").split("/")
    if any(part in ("", ".", "..") for part in parts):
        raise InputError(
            without_secrets(url),
            "an empty part or dots stand between slashes",
            "Rename the object.",
        )
    return Path(f"{scheme}:", *parts)


def url_of(path: Path) -> str:
    """The URL of a path from :func:`path_of`; the text of any other path."""
    return re.sub(rf"^({SCHEME}):/(?!/)", r"\1://", str(path))
