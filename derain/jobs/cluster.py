"""The workers of a Dask cluster as an executor."""

import json
import logging
import socket
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, wait
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from derain.errors import InputError
from derain.jobs.running import Submits
from derain.system.extras import DISTRIBUTED
from derain.system.notices import warn

# Seconds after which a scheduler that does not answer is not there.
PATIENCE = 30

# Loggers of the library that print tracebacks if a scheduler is gone, which one error names.
LOGGERS = ("distributed", "distributed.client", "tornado", "tornado.application")

# Seconds between two looks at whether the scheduler is still there.
BETWEEN_LOOKS = 5


@contextmanager
def dask_executor(address: str) -> Iterator[Submits]:
    """Lends the workers of a Dask cluster.

    Args:
        address: Of its scheduler, such as ``tcp://host:8786``; or the file that the scheduler
            writes with ``--scheduler-file``.

    Raises:
        InputError: No scheduler answers, or the workers have another version of derain, or none.
    """
    distributed = DISTRIBUTED.load("--dask")
    try:
        scheduler = _address(address)
        client = distributed.Client(scheduler, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            "--dask",
            f"no scheduler answers at {address} ({error})",
            "Start one by `dask scheduler`, and give the address that it prints.",
        ) from error
    for logger in LOGGERS:
        logging.getLogger(logger).setLevel(logging.CRITICAL)
    with client:
        _refuse_other_versions(client)
        yield Workers(client)


class Workers:
    """An executor of a client's workers.

    Args:
        client: The client.
    """

    def __init__(self, client: Any) -> None:
        self._client = client
        self._executor = client.get_executor(pure=False)

    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Work":
        """Has a worker call a function."""
        return Work(self._executor.submit(function, *arguments), self._client)


@dataclass(frozen=True)
class Work:
    """A call by a worker, which ends with the scheduler: the library's future may wait for ever.

    Attributes:
        future: The library's future.
        client: The client.
    """

    future: Any
    client: Any

    def done(self) -> bool:
        """True if it is known how the call ended."""
        return bool(self.future.done())

    def result(self) -> Any:
        """Waits for the result of the call, or for its error.

        Raises:
            CancelledError: The scheduler is gone.
        """
        while not self.future.done() and self.client.status != "closed":
            wait([self.future], BETWEEN_LOOKS)
        if not self.future.done():
            raise CancelledError("the scheduler is gone")
        return self.future.result()


def _address(named: str) -> str:
    """The address of a scheduler that listens.

    Args:
        named: The address, or the file that the scheduler writes.

    Raises:
        OSError: Nobody listens there.
        ValueError: It is neither an address nor such a file.
        KeyError: Likewise.
        TypeError: Likewise.
    """
    path = Path(named)
    address = str(json.loads(path.read_bytes())["address"]) if path.is_file() else named
    parts = urlsplit(address)
    if parts.hostname is None or parts.port is None:
        raise ValueError("neither the file of a scheduler nor an address with a port")
    socket.create_connection((parts.hostname, parts.port), PATIENCE).close()
    return address


def _refuse_other_versions(client: Any) -> None:
    """Refuses workers on which derain is another one than here, or none.

    Workers that join later are checked with their first unit.
    """
    versions = client.get_versions(packages=["derain"])
    workers = versions["workers"].values()
    if not workers:
        warn("--dask: the scheduler has no workers yet; scans wait for them")
    here = versions["client"]["packages"]["derain"]
    others = {each["packages"]["derain"] or "none" for each in workers} - {here}
    if others:
        raise InputError(
            "--dask",
            f"this command has derain {here}, and its workers have {', '.join(sorted(others))}",
            "Install the same version of derain on all of them.",
        )
