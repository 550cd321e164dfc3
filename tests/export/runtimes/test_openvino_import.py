"""OpenVINO is imported without the package by which it reports that it was."""

import subprocess
import sys

import pytest

# Stands for OpenVINO, which does with its telemetry what this does.
OPENVINO = """
try:
    import openvino_telemetry.backend
    REPORTED = True
except ImportError:
    REPORTED = False
"""

SCRIPT = """
import sys
if {before}:
    import openvino_telemetry.backend
former = sys.modules.get("openvino_telemetry.backend")
from derain.export.runtimes.openvino import import_openvino
assert not import_openvino().REPORTED
assert sys.modules.get("openvino_telemetry.backend") is former
import openvino_telemetry.backend  # whoever wants it has it
print("done")
"""


@pytest.mark.parametrize("before", [False, True])
def test_it_reports_nothing_and_leaves_its_telemetry_to_others(tmp_path, before) -> None:
    (tmp_path / "openvino.py").write_text(OPENVINO)
    (tmp_path / "openvino_telemetry").mkdir()
    for name in ("__init__", "backend"):
        (tmp_path / f"openvino_telemetry/{name}.py").write_text("")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n{SCRIPT.format(before=before)}"
    finished = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert finished.stdout == "done\n", finished.stderr
