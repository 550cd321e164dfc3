"""Hides Lightning's advertisements and, where derain prints its own lines, its messages."""

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

# The logger of messages that one process of several writes.
MESSAGES = logging.getLogger("lightning.pytorch.utilities.rank_zero")

# The loggers above all of Lightning's.
LOGGERS = ("lightning.pytorch", "lightning.fabric")


def silence_advertisements() -> None:
    """Hides Lightning's tips to install something."""
    MESSAGES.addFilter(_is_no_advertisement)


@contextmanager
def quiet_lightning() -> Iterator[None]:
    """Hides Lightning's messages and advice, such as what hardware it found, in the block."""
    levels = {logger: logger.level for logger in map(logging.getLogger, LOGGERS)}
    try:
        for logger in levels:
            logger.setLevel(logging.WARNING)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", module=r"lightning\.")
            yield
    finally:
        for logger, level in levels.items():
            logger.setLevel(level)


def _is_no_advertisement(record: logging.LogRecord) -> bool:
    return "Tip: " not in record.getMessage()
