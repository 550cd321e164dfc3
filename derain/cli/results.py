"""The line that tells the result of a command, made of what it printed."""

import re

from derain.cli.narration import Transcript


def first_line(printed: Transcript) -> str:
    """What it said first."""
    return printed.said[0]


def last_line(printed: Transcript) -> str:
    """What it said last."""
    return printed.said[-1]


def iou_on(printed: Transcript, scans: str) -> str:
    """IoU on the validation scans, as the progress bar of a training's last epoch shows it.

    Args:
        printed: What the training printed.
        scans: What these scans are called.

    Returns:
        A clause to be added to a sentence; nothing where no score was shown.
    """
    found = re.search(r"val_iou=([\d.]+)", printed.bar)
    return f": IoU {found[1]} on {scans}" if found else ""


def proof_of(printed: Transcript) -> str:
    """The line of an export's proof that says how much the model differs from PyTorch."""
    proof = next(line for line in printed.said if "largest logit difference" in line)
    return f"beside PyTorch {proof.partition(': ')[2]}"
