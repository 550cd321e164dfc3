"""Keeps what Lightning says about its makers' other products out of what derain says."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

# Where Lightning writes what one process of several says.
MESSAGES = logging.getLogger("lightning.pytorch.utilities.rank_zero")

# Above whom all of its messages are.
SPEAKERS = ("lightning.pytorch", "lightning.fabric")


def silence_advertisements() -> None:
    """Lets through all of Lightning's messages but its tips to install something."""
    MESSAGES.addFilter(_is_no_advertisement)


@contextmanager
def no_news() -> Iterator[None]:
    """Keeps back all that is no warning, such as what hardware there is, while the block runs."""
    levels = {logger: logger.level for logger in map(logging.getLogger, SPEAKERS)}
    try:
        for logger in levels:
            logger.setLevel(logging.WARNING)
        yield
    finally:
        for logger, level in levels.items():
            logger.setLevel(level)


def _is_no_advertisement(record: logging.LogRecord) -> bool:
    return "Tip: " not in record.getMessage()
