"""Exports a network on range images for another grid than it was trained on, to be timed there.

python benchmarks/other_grid.py salsanext.ckpt even.ckpt --out salsanext_even.onnx

The weights fit an image of any size, and time does not depend on them; error does, so that of the
exported file says nothing.
"""

import argparse
from dataclasses import replace
from pathlib import Path

from derain.export.onnx_file import export
from derain.models.checkpoint import load_model
from derain.sources.folders import named_frames


def main() -> None:
    """Exports the model."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("checkpoint", type=Path, help="the network")
    parser.add_argument("grid", type=Path, help="checkpoint of a network on the grid")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--calibration", type=Path, nargs="*", default=[], help="for eight bits")
    arguments = parser.parse_args()

    model, other = load_model(arguments.checkpoint), load_model(arguments.grid)
    model.adopt(replace(model.spec, view=other.spec.view))
    export(model, arguments.out, named_frames(arguments.calibration))


if __name__ == "__main__":
    main()
