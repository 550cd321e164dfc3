"""Several processes measure and predict every scan once: what one process finds, to the bit."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from recorded_scenes import write_scenes

from derain.models.measured import MONITOR

from . import two_processes

# Three batches of two for two processes, the last of one scan: one process has a batch less.
POINTS = (300, 40, 500, 120, 260)


@pytest.fixture
def folder(tmp_path) -> Path:
    """Labelled scenes of many sizes."""
    return write_scenes(tmp_path, *POINTS, rain=110)


def test_two_processes_find_what_one_finds(folder) -> None:
    finished = subprocess.run(
        [sys.executable, two_processes.__file__, folder],
        capture_output=True,
        text=True,
        timeout=300,
        start_new_session=True,
    )
    assert finished.returncode == 0, finished.stderr
    for network in two_processes.NETWORKS:
        found = json.loads((folder / network / "found.json").read_text())
        alone = two_processes.measure(folder, folder / network, 1)
        # As text, for a score that is undefined is not equal to itself.
        assert json.dumps(found["scores"], indent=1) == json.dumps(alone, indent=1)
        assert alone["report"]["scans"] == len(POINTS)
        counted = alone["report"]["classes"].values()
        assert sum(counts["points"] for counts in counted) == sum(POINTS)
        # Each process trained on scans of its own; what chose the checkpoint is what one finds.
        assert found["monitor"] == alone["validated"][MONITOR]
        one, two = (
            {path.name: path.read_bytes() for path in (folder / network / labels).iterdir()}
            for labels in ("labels1", "labels2")
        )
        assert one == two
        assert len(one) == len(POINTS)
    # The first process prints what all of them did, and no other prints it again.
    assert finished.stdout.count("mean over scans") == len(two_processes.NETWORKS)
    printed = f"Wrote {len(POINTS)} label files to "
    assert finished.stdout.count(printed) == len(two_processes.NETWORKS)
