"""Memory that one scan leaves is there for the next."""

import ctypes

# Numbers of what mallopt sets, and the most that it takes for the second.
# Source: glibc, malloc/malloc.h and mallopt(3).
TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3
LARGEST_MMAP_THRESHOLD = 2**25

# What a process keeps of freed memory: the arrays of a scan of 400,000 points and more; and in
# training, where a step holds the features of all layers, all that mallopt can be told to.
KEPT = 2**28
KEPT_IN_TRAINING = 2**31 - 1


def keep_freed_memory(kept: int = KEPT) -> None:
    """Has a process keep what it frees, where its C library is glibc; elsewhere nothing happens.

    A command takes scan after scan of one size. By default glibc gives the arrays of each back to
    the system and asks for those of the next anew, page by page.

    Args:
        kept: The most that it keeps, bytes, below 2³¹.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):  # another C library, or another system
        return
    mallopt(MMAP_THRESHOLD, LARGEST_MMAP_THRESHOLD)
    mallopt(TRIM_THRESHOLD, kept)
