"""Memory of one scan that the next one reuses."""

import ctypes
import os
from contextlib import suppress
from pathlib import Path

# Parameters of mallopt, and the largest value of the second.
# Source: glibc, malloc/malloc.h and mallopt(3).
TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3
LARGEST_MMAP_THRESHOLD = 2**25

# Freed memory that a process keeps, bytes: more than the arrays of a scan of 400,000 points; in
# training, where a step holds the features of all layers, the most that mallopt accepts.
KEPT = 2**28
KEPT_IN_TRAINING = 2**31 - 1

# Where Linux has the limit of a container's memory.
# Source: Linux, Documentation/admin-guide/cgroup-v2.rst.
GROUP_LIMIT = Path("/sys/fs/cgroup/memory.max")


def keep_freed_memory(kept: int = KEPT) -> None:
    """Keeps freed memory in the process, where its C library is glibc; elsewhere it does nothing.

    A command reads scan after scan of one size. By default glibc returns the arrays of each to the
    system and requests those of the next, page by page. The commands of derain call this; a program
    that judges scans in a loop calls it once, before the first.

    Args:
        kept: Most memory to keep, bytes, below 2³¹.

    Example:
        >>> import derain
        >>> derain.keep_freed_memory()
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):  # another C library, or another system
        return
    mallopt(MMAP_THRESHOLD, LARGEST_MMAP_THRESHOLD)
    mallopt(TRIM_THRESHOLD, kept)


def total_memory() -> int:
    """Bytes of memory that this process may have; of systems that do not name it, none."""
    try:
        memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return 0
    with suppress(OSError, ValueError):  # ValueError: no limit, ``max``, is no number
        memory = min(memory, int(GROUP_LIMIT.read_text("utf-8")))
    return memory
