"""Storage for the trials of a search: a file, or a database that several machines reach."""

import re
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

from derain.errors import InputError, reason_of

if TYPE_CHECKING:
    from optuna.storages import BaseStorage

# Ending of the file that Optuna's journal is kept in; any other file is an SQLite database.
JOURNAL = ".journal"

# Two searches that make the tables of a database at once are in each other's way for a moment.
ATTEMPTS, PAUSE = 5, 0.3  # seconds

# How long a search waits for another one that writes to an SQLite database, in seconds.
SQLITE_TIMEOUT = 60

# What stands before a password in an address, and the password.
_PASSWORD = re.compile(r"(?<=://)([^:/@]*:)(.*)(?=@)")
_PASSWORD_OPTION = re.compile(r"(?i)((?:password|passwd|pwd)=)([^&]*)")


@dataclass(frozen=True)
class Storage:
    """A place for trials. As text it has no password, so that it may be printed and written.

    Attributes:
        place: URL of a database as SQLAlchemy takes it, or a file: Optuna's journal where its name
            ends in ``.journal``, otherwise an SQLite database.
    """

    place: str

    def __str__(self) -> str:
        return _PASSWORD_OPTION.sub(r"\1***", _PASSWORD.sub(r"\1***", self.place))

    def open(self) -> "BaseStorage":
        """Opens the storage, and makes what is missing of it.

        Raises:
            InputError: An address that is none, a database that cannot be reached or whose driver
                is not installed, or a file that holds something else.
        """
        from sqlalchemy.exc import SQLAlchemyError

        if Path(self.place).suffix == JOURNAL and "://" not in self.place:
            return self._journal()
        url = self.place if "://" in self.place else f"sqlite:///{self.place}"
        self._refuse_no_address(url)
        try:
            return _database(url)
        except ImportError as error:
            driver = getattr(error.__cause__, "name", None) or "its driver"
            raise InputError(
                str(self),
                f"needs {driver}, which is not installed",
                "Install it, or name another in the address: postgresql+psycopg://.",
            ) from error
        except (SQLAlchemyError, RuntimeError) as error:  # the second of another Optuna's tables
            raise self.refused(error) from error

    def refused(self, error: Exception) -> InputError:
        """The error for a storage that failed, without the password."""
        # SQLAlchemy's message goes on for lines, with the statement and a link.
        reason = (str(error).splitlines() or [reason_of(error)])[0]
        passwords = [found[2] for found in _PASSWORD.finditer(self.place)]
        passwords += [found[2] for found in _PASSWORD_OPTION.finditer(self.place)]
        for password in filter(None, passwords):
            reason = reason.replace(password, "***").replace(unquote(password), "***")
        return InputError(
            str(self),
            f"cannot be used as storage ({reason})",
            "Name a new file that can be written, or the address of a database.",
        )

    def _journal(self) -> "BaseStorage":
        from optuna.storages import JournalStorage
        from optuna.storages.journal import JournalFileBackend

        try:
            return JournalStorage(JournalFileBackend(self.place))
        except (OSError, ValueError, TypeError, LookupError) as error:  # what is no journal
            raise self.refused(error) from error

    def _refuse_no_address(self, url: str) -> None:
        from sqlalchemy.engine import make_url
        from sqlalchemy.exc import ArgumentError

        try:
            make_url(url)
        except (ArgumentError, ValueError):  # whose message may hold part of a password
            raise InputError(
                str(self),
                "is not the address of a database",
                "Write postgresql://USER@HOST/DATABASE, with %40 for an @ in a name or password.",
            ) from None


def _database(url: str) -> "BaseStorage":
    from optuna.storages import RDBStorage, get_storage
    from sqlalchemy.exc import DBAPIError

    options: dict[str, Any] = {}
    if url.startswith("sqlite"):
        options["connect_args"] = {"timeout": SQLITE_TIMEOUT}
    for _ in range(ATTEMPTS - 1):
        with suppress(DBAPIError):  # as where another search makes the same tables
            return get_storage(RDBStorage(url, engine_kwargs=options))
        time.sleep(PAUSE)
    return get_storage(RDBStorage(url, engine_kwargs=options))
