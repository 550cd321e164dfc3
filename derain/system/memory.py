"""Memory of one scan that the next one reuses."""

import ctypes
import os

# Parameters of mallopt, and the largest value of the second.
# Source: glibc, malloc/malloc.h and mallopt(3).
TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3
LARGEST_MMAP_THRESHOLD = 2**25

# Freed memory that a process keeps, bytes: more than the arrays of a scan of 400,000 points; in
# training, where a step holds the features of all layers, the most that mallopt accepts.
KEPT = 2**28
KEPT_IN_TRAINING = 2**31 - 1


def keep_freed_memory(kept: int = KEPT) -> None:
    """Keeps freed memory in the process, where its C library is glibc; elsewhere it does nothing.

    A command reads scan after scan of one size. By default glibc returns the arrays of each to the
    system and requests those of the next, page by page.

    Args:
        kept: Most memory to keep, bytes, below 2³¹.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):  # another C library, or another system
        return
    mallopt(MMAP_THRESHOLD, LARGEST_MMAP_THRESHOLD)
    mallopt(TRIM_THRESHOLD, kept)


def total_memory() -> int:
    """Bytes of the machine's memory; of systems that do not name it, none."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return 0
