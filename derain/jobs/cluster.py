"""The workers of a Dask cluster as an executor."""

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import derain
from derain.errors import InputError
from derain.jobs.running import Submits
from derain.system.extras import DISTRIBUTED
from derain.system.notices import warn

# Seconds after which a scheduler that does not answer is not there.
PATIENCE = 30


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
    named = _named(address)
    try:
        client = distributed.Client(**named, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise _no_scheduler(address, str(error)) from error
    with client:
        _refuse_other_versions(client)
        yield client.get_executor(pure=False)


def _named(address: str) -> dict[str, str]:
    """The scheduler as Dask's client takes it.

    Raises:
        InputError: Nobody listens there, or it is neither an address nor a file.
    """
    if Path(address).is_file():
        return {"scheduler_file": address}
    parts = urlsplit(address)
    try:
        if parts.hostname is None or parts.port is None:
            raise ValueError("neither a file nor an address with a port")
        socket.create_connection((parts.hostname, parts.port), PATIENCE).close()
    except (OSError, ValueError) as error:
        raise _no_scheduler(address, str(error)) from error
    return {"address": address}


def _no_scheduler(address: str, reason: str) -> InputError:
    return InputError(
        "--dask",
        f"no scheduler answers at {address} ({reason})",
        "Start one by `dask scheduler`, and give the address that it prints.",
    )


def version() -> str:
    """The version of derain in the process that calls this."""
    return derain.__version__


def _refuse_other_versions(client: Any) -> None:
    """Refuses workers on which derain is another one than here, or none.

    Those that come later are asked with their first unit.
    """
    try:
        versions = set(client.run(version).values())
    except Exception as error:  # of which Dask keeps no more than the text
        if "No module named" not in str(error):
            raise
        reason = f"its workers cannot import derain ({error})"
        raise InputError("--dask", reason, _INSTALL) from error
    if not versions:
        warn("--dask: the scheduler has no workers yet; scans wait for them")
    if others := versions - {derain.__version__}:
        raise InputError(
            "--dask",
            f"its workers have derain {', '.join(sorted(others))}, and this command "
            f"{derain.__version__}",
            _INSTALL,
        )


_INSTALL = "Install the same version of derain on all of them."
