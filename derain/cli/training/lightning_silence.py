"""Keeps what Lightning says about its makers' other products out of what derain says."""

import logging

# Where Lightning writes what one process of several says.
MESSAGES = logging.getLogger("lightning.pytorch.utilities.rank_zero")


def silence_advertisements() -> None:
    """Lets through all of Lightning's messages but its tips to install something."""
    MESSAGES.addFilter(_is_no_advertisement)


def _is_no_advertisement(record: logging.LogRecord) -> bool:
    return "Tip: " not in record.getMessage()
