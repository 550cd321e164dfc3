"""What is asked of each of the scripts beside this one, which run where derain is not installed."""

import argparse
from pathlib import Path


def asked(description):
    """The words of the command line: to make bags of scans, or to compare two bags."""
    parser = argparse.ArgumentParser(description=description.split("\n", 1)[0])
    commands = parser.add_subparsers(dest="command", required=True)
    make = commands.add_parser("make", help="bags of scans")
    make.add_argument("out", type=Path)
    make.add_argument("scans", type=Path, help="folder of .bin")
    make.add_argument("--scans", type=int, default=5, dest="number")
    compare = commands.add_parser("compare", help="a bag, and what derain made of it")
    compare.add_argument("before", type=Path)
    compare.add_argument("after", type=Path)
    compare.add_argument("masks", type=Path, help="folder of .label, in the order of the clouds")
    return parser.parse_args()
