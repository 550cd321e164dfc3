"""Checksums of every method's answers on the real scans, to compare before and after a change.

python -m benchmarks.masks --shared ../shared [METHOD.onnx...] > masks.txt
"""

import argparse
import hashlib
from pathlib import Path

import numpy as np

from derain.errors import InputError
from derain.export.methods import load_method, method_names
from derain.sources.folders import named_frames
from derain.sources.judging import judgements
from derain.system.cores import usable_cores


def main() -> None:
    """Prints a line for each method and recording: two checksums, both names."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", nargs="*", help="exported models, besides all named methods")
    parser.add_argument("--shared", type=Path, required=True, help="folder with data/")
    arguments = parser.parse_args()

    for name in [*method_names(), *arguments.models]:
        for recording in _recordings(arguments.shared / "data"):
            answers = _checksums(name, recording)
            print(*answers, Path(name).name, recording.relative_to(arguments.shared), flush=True)


def _recordings(data: Path) -> list[Path]:
    """The sample, the two drives, and each clean scan by itself."""
    wads = data / "wads"
    clean = sorted(path for path in (data / "clean").iterdir() if path.is_file())
    return [wads / "sample.bin", wads / "drive", data / "snowykitti", *clean]


def _checksums(name: str, recording: Path) -> tuple[str, str]:
    """Checksums of the masks and of the probabilities; of the error where there are none."""
    masks, probabilities = hashlib.sha256(), hashlib.sha256()
    try:
        method = load_method(name, {}, usable_cores())
        for _, judgement, _ in judgements(method, named_frames([recording])):
            masks.update(np.packbits(judgement.rain).tobytes())
            probabilities.update(judgement.probability.tobytes())
    except InputError as error:
        masks.update(error.reason.encode())
    return masks.hexdigest()[:16], probabilities.hexdigest()[:16]


if __name__ == "__main__":
    main()
