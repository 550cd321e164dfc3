"""The demonstration shows its steps, and leaves the files that it names."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
import yaml
from matplotlib.image import imread
from recorded_scenes import write_scenes

from derain.export.bench.cost import Effort
from derain.export.bench.report import SHORT
from derain.files import DEFAULT_COLUMNS, read_scan
from derain.simulation.campaign import Campaign
from derain.workflows.demo import DemoConfig, clean_given_scans, run_demo
from derain.workflows.progress import Steps


@pytest.fixture
def small(open3d, here, short_proof) -> DemoConfig:
    """Three streets of one scan each, one network for one epoch, and two methods beside it."""
    Path("sensor.yaml").write_text(yaml.safe_dump({"rows": 16, "columns": 60}))
    return DemoConfig(
        Path("my demo"),
        streets=Campaign(1, 1, 1, scans=1, rain_rates=(50.0,), sensor="sensor.yaml"),
        networks=("3D-OutDet",),
        others=("default", "none"),
        settings={"trainer.max_epochs": 1, "panels.scans": 0},
        effort=Effort(timed=1, repeats=1),
        workers=1,
    )


@pytest.mark.usefixtures("one_block")
def test_every_step_is_shown_and_leaves_its_files(small) -> None:
    lines: list[str] = []
    bench = run_demo(small, lines.append)
    steps = [line.partition(":")[0] for line in lines if re.match(r"[A-Z]\w+: ", line)]
    of_network = ["Training", "Export", "Cleaning"]
    assert steps == ["Cleaning", "Simulation", "Tuning", *of_network, "Comparison"]
    assert any(line.endswith(f"(step {len(steps)} of {len(steps)})") for line in lines)
    times = [line for line in lines if re.match(r"  \d+:\d\d  \S", line)]
    assert len(times) == len(steps)
    assert any("IoU 0." in line for line in times)
    (table,) = [line.splitlines() for line in lines if line.startswith("\n| method")]
    assert [name.strip() for name in table[1].split("|")[1:-1]] == [*SHORT]
    titles = ["3D-OutDet", "dsor, tuned", "default", "none"]
    assert [row.title for row in bench.rows] == titles
    assert [row.split("|")[1].strip() for row in table[3:]] == titles

    out = small.out
    assert any("points are rain or snow" in line for line in lines)
    for picture in ("example/before_after.png", "before_after.png", "bench/speed_error.png"):
        assert imread(out / picture)[..., :3].std() > 0
    (scan,) = (out / "simulated/sequences/002/lidar_radar_pcd").glob("*.bin")
    rain = np.fromfile(out / "cleaned" / f"{scan.stem}.label", "<u4") == 1
    kept = read_scan(out / "cleaned" / scan.name)
    np.testing.assert_array_equal(kept.xyz, read_scan(scan).xyz[~rain])
    assert list(out.glob("runs/outdet_simulated/version_0/events.out.tfevents.*"))

    tuned_by = shlex.split((out / "dsor.yaml").read_text().splitlines()[0])
    for words in (tuned_by, shlex.split(bench.facts["command"])):
        assert words[words.index("--data") + 1] == "my demo/simulated"


def test_the_model_that_comes_with_derain_cleans_your_own_scans(tmp_path, capsys) -> None:
    mine = write_scenes(tmp_path / "mine", 500, 500, name="{}.bin")
    (mine / "cut.bin").write_bytes(b"12345")
    out, lines = tmp_path / "out", []
    report = clean_given_scans(mine, DEFAULT_COLUMNS, out, Steps(lines.append, 1))
    assert sum(scan.points for scan in report.scans) == 1000
    assert [Path(error.subject).name for error in report.failures] == ["cut.bin"]
    assert "cut.bin: 5 bytes are not whole rows" in capsys.readouterr().err
    assert imread(out / "before_after.png")[..., :3].std() > 0
    assert {path.name for path in out.glob("*.label")} == {"0.label", "1.label"}
    # A demonstration of the example writes elsewhere, so that a later one does not mix them.
    assert DemoConfig(out, scan=mine).given != DemoConfig(out).given


def test_an_unreadable_scan_is_refused_before_the_first_step(tmp_path, run_derain) -> None:
    (tmp_path / "cut.bin").write_bytes(b"12345")
    for name, reason in (("cut.bin", "5 bytes are not whole rows"), ("none", "there is no such")):
        outcome = run_derain("demo", "--out", tmp_path / "out", "--scan", tmp_path / name)
        assert (outcome.code, outcome.out) == (2, "")
        assert reason in outcome.err
    assert not (tmp_path / "out").exists()
