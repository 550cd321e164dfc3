"""A process keeps what it frees, if it is set to."""

import platform
import subprocess
import sys

import pytest

FAULTS = """
import resource
import numpy as np
from derain.system.memory import keep_freed_memory

if {keep}:
    keep_freed_memory()
np.ones(2_000_000)
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20):
    arrays = [np.ones(1_900_000) for _ in range(6)]
    del arrays
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another C library than glibc")
def test_arrays_of_one_size_take_each_others_place() -> None:
    kept, default = (
        int(subprocess.check_output([sys.executable, "-c", FAULTS.format(keep=keep)], text=True))
        for keep in (True, False)
    )
    assert 2 * kept < default
