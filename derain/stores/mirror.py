"""A temporary folder in which objects lie at the paths that stand for their URLs."""

import os
import re
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import gettempdir

from derain.errors import InputError
from derain.files.atomic import temporary_folder, writing
from derain.stores.objects import StoredObject, fetch, upload
from derain.stores.url import SCHEME, Place, is_url, path_of

# Name of the file in a mirror that stands for others.
EMPTY = ".empty"


class Mirror:
    """Copies of objects.

    Args:
        root: The folder.
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        self._inside = re.compile(rf"{re.escape(str(root))}/({SCHEME}):/")

    def path_of(self, url: str) -> Path:
        """The path of an object or a folder."""
        return self.root / path_of(url)

    def fetch(self, objects: Iterable[StoredObject]) -> None:
        """Copies objects.

        Raises:
            InputError: One of them cannot be copied whole.
        """
        with writing(self.root):
            fetch({self.root / stored.path: stored for stored in objects})

    def mark(self, paths: Iterable[Path]) -> None:
        """Makes an empty file for each object: enough to see which there are.

        Args:
            paths: The paths that stand for the objects' URLs. No object is fetched.

        Raises:
            InputError: A path is too long for a file, or both a file and a folder.
        """
        folder, empty = self.root, self.root / EMPTY
        with writing(empty):
            empty.touch()
        for path in paths:
            file = self.root / path
            with writing(file):
                if file.parent != folder:
                    folder = file.parent
                    folder.mkdir(parents=True, exist_ok=True)
                try:
                    os.link(empty, file)  # takes a tenth of the time to make a file
                except OSError:  # the number of links to a file is limited, perhaps to none
                    file.touch()
                    empty = file

    def with_urls(self, text: str) -> str:
        """A text with URLs in place of paths in the folder."""
        return self._inside.sub(r"\1://", text)

    def error_with_urls(self, error: InputError) -> InputError:
        """An error that names URLs in place of paths in the folder."""
        parts = map(str, (error.subject, error.reason, error.remedy))
        return InputError(*map(self.with_urls, parts))


@contextmanager
def mirror() -> Iterator[Mirror]:
    """Lends an empty mirror, which is gone after the block; errors of the block name URLs.

    Raises:
        InputError: The folder for temporary files cannot be written.
    """
    with ExitStack() as stack:
        with writing(Path(gettempdir())):
            root = stack.enter_context(temporary_folder(Path(gettempdir())))
        lent = Mirror(root)
        try:
            yield lent
        except InputError as error:
            raise lent.error_with_urls(error) from error


@contextmanager
def uploaded(place: Place, stamps: dict[str, str]) -> Iterator[Path]:
    """Provides a folder to write to for a place.

    Args:
        place: A folder, which is used itself; or a URL, which gets a temporary folder, whose
            files are uploaded when the block ends well.
        stamps: Receives the sizes and versions of the uploaded files, by path.

    Raises:
        InputError: The folder for temporary files cannot be written, or the store.
    """
    if not is_url(place):
        yield Path(place)
        return
    with mirror() as lent:
        yield lent.root
        stamps |= upload(lent.root, str(place))
