"""A store in memory, which may refuse requests and cut off what is read."""

from collections.abc import Iterator

import fsspec
import pytest
from fsspec.implementations.memory import MemoryFileSystem

from benchmarks.s3_server import Faults


class FailingStore(MemoryFileSystem):
    """A store ``failing://``, of which some requests fail."""

    protocol = "failing"
    store: dict = {}  # noqa: RUF012
    pseudo_dirs = [""]  # noqa: RUF012
    faults = Faults()

    def get_file(self, rpath, lpath, **options):
        cut = self._next(is_read=True)
        super().get_file(rpath, lpath, **options)
        if cut:
            with open(lpath, "r+b") as file:
                file.truncate(1)

    def cat_file(self, path, start=None, end=None, **options):
        cut = self._next(is_read=True)
        content = super().cat_file(path, start, end, **options)
        return content[:1] if cut else content

    def put_file(self, lpath, rpath, **options):
        self._next(is_read=False)
        super().put_file(lpath, rpath, **options)

    def pipe_file(self, path, value, mode="overwrite", **options):
        self._next(is_read=False)
        super().pipe_file(path, value, mode=mode, **options)

    def _next(self, is_read: bool) -> bool:
        refused, cut = self.faults.next(is_read)
        if refused:
            raise OSError("Please reduce your request rate")
        return cut


@pytest.fixture
def store(monkeypatch) -> Iterator[FailingStore]:
    """An empty store that works, and that is tried again at once where it is made to fail."""
    fsspec.register_implementation("failing", FailingStore, clobber=True)
    monkeypatch.setattr(FailingStore, "store", {})
    monkeypatch.setattr(FailingStore, "faults", Faults())
    monkeypatch.setattr("derain.stores.objects.WAITS", (0.0,) * 20)
    return FailingStore()
