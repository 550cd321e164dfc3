"""Locks on files, which the system releases when the process that holds them dies."""

import errno
import os


def lock(descriptor: int, *, wait: bool) -> bool:
    """Locks an open file or folder, until it is closed, against all others that ask in this way.

    Args:
        descriptor: The file, open for writing, or the folder.
        wait: Whether to wait for another process that holds it.

    Returns:
        False where another holds it and is not waited for.

    Raises:
        OSError: There are no locks: the system is Windows, or the file system has none.
    """
    try:
        import fcntl
    except ImportError as error:
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS)) from error
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except BlockingIOError:
        return False
    return True
