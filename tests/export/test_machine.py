"""What a report of times says of the machine."""

import platform

import numpy as np
import onnxruntime

import derain
from derain.export.machine import versions


def test_the_versions_are_those_that_run() -> None:
    for version in (
        f"derain {derain.__version__}",
        f"onnxruntime {onnxruntime.__version__}",
        f"NumPy {np.__version__}",
        f"Python {platform.python_version()}",
    ):
        assert version in versions()
    assert not versions().startswith(";")
