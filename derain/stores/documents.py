"""Small documents of JSON in a folder, of this machine or of a store; each is written whole."""

import json
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

from derain.files.atomic import temporary_folder, write_text, writing
from derain.stores.objects import AT_ONCE, opened, tried
from derain.stores.url import Place, is_url

# Documents of a store that are read before the first of them is needed.
READ_AT_ONCE = 20 * AT_ONCE


def documents_at(folder: Place, name: str) -> "Documents":
    """The documents in a folder of a place.

    Args:
        folder: The place.
        name: Name of the folder in it.
    """
    if is_url(folder):
        return ObjectDocuments(f"{str(folder).rstrip('/')}/{name}")
    return FileDocuments(Path(folder, name))


class FileDocuments:
    """Documents in a folder of this machine, or of a file system that several share.

    Documents have relative paths for names.

    Args:
        folder: The folder, made when the first is written.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def read(self, name: str) -> bytes | None:
        """The content of a document; None if it is missing or cannot be read."""
        with suppress(OSError):
            return (self._folder / name).read_bytes()
        return None

    def read_each(self, names: Sequence[str]) -> Iterator[bytes | None]:
        """The contents of many, each read at its first use."""
        yield from map(self.read, names)

    def write(self, name: str, text: str) -> None:
        """Writes a whole document, and replaces an existing one.

        Raises:
            InputError: It cannot be written.
        """
        write_text(self._folder / name, text)

    def create(self, name: str, text: str) -> None:
        """Writes a document unless it exists; read it back to find which one was kept.

        Raises:
            InputError: It cannot be written.
        """
        path = self._folder / name
        if path.exists():
            return
        with writing(path), temporary_folder(path.parent) as temporary:
            written = temporary / path.name
            written.write_text(text, "utf-8")
            try:
                os.link(written, path)  # unlike os.replace, it fails where another was quicker
            except FileExistsError:
                return
            except OSError:  # a file system without links
                os.replace(written, path)

    def remove_all(self) -> None:
        """Removes the folder, at once for its readers."""
        if not self._folder.exists():
            return
        with writing(self._folder), temporary_folder(self._folder.parent) as temporary:
            os.replace(self._folder, temporary / self._folder.name)


class ObjectDocuments:
    """Documents in a folder of an object store, by the same names and methods.

    Each method raises an InputError where the store cannot be reached.

    Args:
        url: URL of the folder.

    Raises:
        InputError: No such store, or a library is missing.
    """

    def __init__(self, url: str) -> None:
        self._url = url
        self._filesystem, path = opened(url)
        self._folder = path.rstrip("/")

    def read(self, name: str) -> bytes | None:
        """The content of a document; None if it is missing."""

        def content() -> bytes | None:
            try:
                read: bytes = self._filesystem.cat_file(f"{self._folder}/{name}")
            except FileNotFoundError:
                return None
            json.loads(read)  # a read that breaks off shows here, and is tried again
            return read

        return tried(f"{self._url}/{name}", content)

    def read_each(self, names: Sequence[str]) -> Iterator[bytes | None]:
        """The contents of many documents, several read at a time; one listing finds them."""
        keys = tried(self._url, lambda: self._filesystem.find(self._folder))
        there = {key[len(self._folder) + 1 :] for key in keys}
        with ThreadPoolExecutor(AT_ONCE) as pool:
            for begin in range(0, len(names), READ_AT_ONCE):
                some = names[begin : begin + READ_AT_ONCE]
                yield from pool.map(lambda name: self.read(name) if name in there else None, some)

    def write(self, name: str, text: str) -> None:
        """Writes a document whole."""
        key, content = f"{self._folder}/{name}", text.encode()
        tried(f"{self._url}/{name}", lambda: self._filesystem.pipe_file(key, content))

    def create(self, name: str, text: str) -> None:
        """Writes a document unless it exists."""
        if self.read(name) is not None:
            return
        try:
            self._filesystem.pipe_file(f"{self._folder}/{name}", text.encode(), mode="create")
        except Exception:  # it exists, the request failed, or the store has no such mode
            if self.read(name) is None:
                self.write(name, text)

    def remove_all(self) -> None:
        """Removes all documents."""

        def remove() -> None:
            with suppress(FileNotFoundError):
                self._filesystem.rm(self._folder, recursive=True)

        tried(self._url, remove)


# Documents of a folder, wherever it is.
Documents = FileDocuments | ObjectDocuments
