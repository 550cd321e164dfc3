"""Shared functions of the scripts beside this one, which run without derain."""

import argparse
from pathlib import Path

import numpy as np

POINTS = "/velodyne_points"
PERIOD, START = 100_000_000, 1_700_000_000_123_456_789  # nanoseconds


def make_or_compare(description, make, compare):
    """Makes bags of scans, or compares two bags; the exit code is 1 where they differ.

    Args:
        description: What the script is.
        make: Writes to a path bags of some files of scans.
        compare: Finds what is the same in a bag and in what derain made of it, given the masks of
            its clouds, by name.
    """
    parser = argparse.ArgumentParser(description=description.split("\n", 1)[0])
    commands = parser.add_subparsers(dest="command", required=True)
    making = commands.add_parser("make", help="bags of scans")
    making.add_argument("out", type=Path)
    making.add_argument("scans", type=Path, help="folder of .bin")
    making.add_argument("--scans", type=int, default=5, dest="number")
    comparing = commands.add_parser("compare", help="a bag, and what derain made of it")
    comparing.add_argument("before", type=Path)
    comparing.add_argument("after", type=Path)
    comparing.add_argument("masks", type=Path, help="folder of .label, in the order of the clouds")
    arguments = parser.parse_args()
    if arguments.command == "make":
        make(arguments.out, sorted(arguments.scans.glob("*.bin"))[: arguments.number])
        return 0
    masks = [np.fromfile(mask, "<u4") == 1 for mask in sorted(arguments.masks.glob("*.label"))]
    findings = compare(arguments.before, arguments.after, masks)
    for title, same in findings.items():
        print(f"{arguments.before.stem:10} {'same' if same else 'DIFFERENT':10} {title}")
    return 0 if all(findings.values()) else 1


def points_that_stay(before, after, masks):
    """Checks, by title, that the clouds after are those before without their rain."""
    kept = [points[~rain] for points, rain in zip(before, masks, strict=True)]
    same = len(after) == len(kept) and all(map(np.array_equal, after, kept))
    return {f"{sum(map(len, after)):,} points left of {sum(map(len, masks)):,}": same}


def messages_that_stay(before, after, head):
    """Checks that messages are equal in number and headers, and equal except for the clouds.

    Args:
        before: Messages, whose first member is the topic.
        after: Messages of the other bag.
        head: What the members are called that all messages keep, and how many these are.
    """
    name, number = head
    others = [(a, b) for a, b in zip(before, after, strict=False) if a[0] != POINTS]
    return {
        f"{len(before)} messages": len(before) == len(after),
        name: [m[:number] for m in before] == [m[:number] for m in after],
        f"{len(others)} messages of other topics, byte for byte": all(a == b for a, b in others),
    }
