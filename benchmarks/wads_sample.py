"""Error and time on the published WADS sample scan, of exported models and of a one-line rule.

python benchmarks/wads_sample.py WADS/sample.bin published.onnx trained.onnx
"""

import argparse
from pathlib import Path

from labelled import read_labelled

from derain.cards import load_card
from derain.export.comparison import Method, as_table, compare
from derain.export.latency import versions
from derain.export.runtime import Derainer
from derain.one_line_rule import OneLineRule

REPEATS = 30


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scan", type=Path)
    parser.add_argument("models", type=Path, nargs="+")
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args()

    rule = OneLineRule(intensity=0, range=20)
    methods: dict[str, Method] = {"intensity 0 and range <= 20 m": lambda scan, _: rule(scan)}
    for model in arguments.models:
        methods[model.stem] = Derainer(model, arguments.threads)
    rows = compare(methods, [arguments.scan] * REPEATS, read_labelled, load_card("wads"))
    print(as_table(rows))
    print(f"{arguments.threads} threads, median of {REPEATS}; {versions()}")


if __name__ == "__main__":
    main()
