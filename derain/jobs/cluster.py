"""The workers of a Dask cluster as an executor."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import derain
from derain.errors import InputError
from derain.jobs.running import Submits
from derain.system.extras import DISTRIBUTED

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
    named = {"scheduler_file": address} if Path(address).is_file() else {"address": address}
    try:
        client = distributed.Client(**named, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            "--dask",
            f"no scheduler answers at {address} ({error})",
            "Start one by `dask scheduler`, and give the address that it prints.",
        ) from error
    with client:
        _refuse_other_versions(client)
        yield client.get_executor(pure=False)


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
    if others := versions - {derain.__version__}:
        raise InputError(
            "--dask",
            f"its workers have derain {', '.join(sorted(others))}, and this command "
            f"{derain.__version__}",
            _INSTALL,
        )


_INSTALL = "Install the same version of derain on all of them."
