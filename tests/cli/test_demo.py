"""The demo tells its story on a screen, and leaves what it names."""

import io
import re
import shlex
import sys
import threading
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import yaml
from matplotlib.image import imread

from derain.cli import demo, narration
from derain.cli.demo import STREETS, Story, tell
from derain.cli.demo_scan import clean_own_scans, taken_by_range
from derain.cli.main import main
from derain.cli.narration import Narrator, Transcript
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export import onnx_file
from derain.files import DEFAULT_COLUMNS, read_scan
from derain.scan import Scan
from derain.simulation.campaign import Campaign, partition
from derain.system.open3d_import import import_open3d


@pytest.fixture
def small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Story:
    """Three streets of one scan each, one network for one epoch, and one method beside it."""
    try:
        import_open3d()
    except InputError as error:
        pytest.skip(str(error))
    monkeypatch.chdir(tmp_path)
    # How far a step is has a test of its own, and so has the whole proof.
    monkeypatch.setattr(narration, "PERIODS", {True: 3600, False: 3600})
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: [("scene", Scan.of(scene(100)))])
    Path("sensor.yaml").write_text(yaml.safe_dump({"rows": 16, "columns": 60}))
    return Story(
        Path("demo"),
        streets=(
            *("--layout", "street", "--sequences", "3", "--scans", "1", "--rain", "50"),
            *("--sensor", "sensor.yaml", "--no-radar", "--workers", "1"),
        ),
        networks=("3D-OutDet",),
        others=("default", "none"),
        fit=("--trainer.max_epochs", "1", "--panels.scans", "0"),
        bench=("--timed", "1", "--repeats", "1"),
    )


@pytest.mark.usefixtures("one_block")
def test_every_step_is_told_and_leaves_what_it_says(
    small: Story, capsys: pytest.CaptureFixture[str]
) -> None:
    tell(small)
    lines = capsys.readouterr().out.splitlines()
    commands = [line for line in lines if line.startswith("$ ")]
    steps = ["simulate", "tune", "view", "fit", "export", "run", "bench"]
    assert [shlex.split(command)[2] for command in commands] == steps
    times = [line for line in lines if re.fullmatch(r"  \d+:\d\d  \S.*", line)]
    assert len(times) == len(steps)
    assert any("3D-OutDet trained: IoU 0." in line for line in times)
    table = [line.split("|")[1].strip() for line in lines if line.startswith("| ")]
    assert table == ["method", "3D-OutDet", "dsor, tuned", "default", "none"]
    (header,) = [line for line in lines if line.startswith("| method")]
    assert [name.strip() for name in header.split("|")[1:-1]] == list(demo.SHOWN)
    assert len(lines) <= 40

    out = small.out
    for picture in ("filters.png", "before_after.png", "bench/speed_error.png"):
        assert imread(out / picture)[..., :3].std() > 0
    (scan,) = (out / "simulated/sequences/002/lidar_radar_pcd").glob("*.bin")
    rain = np.fromfile(out / "cleaned" / f"{scan.stem}.label", "<u4") == 1
    kept = read_scan(out / "cleaned" / scan.name)
    np.testing.assert_array_equal(kept.xyz, read_scan(scan).xyz[~rain])
    assert list(out.glob("runs/outdet_simulated/version_0/events.out.tfevents.*"))
    log = (out / "log.txt").read_text()
    assert all(command in log for command in commands)
    assert "it/s" not in log


def test_the_model_that_comes_with_derain_cleans_scans_of_the_users_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    for number in range(2):
        scene(500, number).tofile(mine / f"{number}.bin")
    np.full((60, 4), 1e5, np.float32).tofile(mine / "far.bin")
    out = tmp_path / "out"
    clean_own_scans(Narrator(main, tmp_path / "log.txt"), mine, DEFAULT_COLUMNS, out)
    command, result, *warnings, by_range, picture = capsys.readouterr().out.splitlines()
    assert command == f"$ derain run default {mine} --out {out} --columns x,y,z,intensity"
    assert "2 scans: 1,000 points" in result
    assert any("far.bin: left whole" in warning for warning in warnings)
    assert re.fullmatch(r"  taken by range: 0-10 m [\d.]+%, .*, 40-80 m [\d.]+%", by_range)
    assert picture == f"  before and after: {out / 'before_after.png'}"
    assert imread(out / "before_after.png")[..., :3].std() > 0
    assert {path.name for path in out.glob("*.label")} == {"0.label", "1.label"}


def test_what_is_taken_is_counted_by_range() -> None:
    xyz = np.zeros((6, 3), np.float32)
    xyz[:, 0] = [9.9, 10, 39, 500, 0, 8]
    rain = np.array([True, False, True, False, True, False])
    counted = taken_by_range(Scan(xyz), rain)
    assert counted.tolist() == [[2, 1], [1, 0], [1, 1], [0, 0], [1, 0]]


def test_a_scan_that_cannot_be_read_is_told_before_the_story_begins(
    tmp_path: Path, run_derain
) -> None:
    (tmp_path / "cut.bin").write_bytes(b"12345")
    for name, reason in (("cut.bin", "5 bytes are not whole rows"), ("none", "there is no such")):
        outcome = run_derain("demo", "--out", tmp_path / "out", "--scan", tmp_path / name)
        assert (outcome.code, outcome.out) == (2, "")
        assert reason in outcome.err
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("small")
def test_a_step_that_fails_says_why_and_ends_the_story(capsys: pytest.CaptureFixture[str]) -> None:
    Path("demo/simulated").mkdir(parents=True)
    Path("demo/simulated/mine.txt").touch()
    with pytest.raises(SystemExit) as leaving:
        main(["demo"])
    assert leaving.value.code == 2
    outcome = capsys.readouterr()
    assert [line.split()[2] for line in outcome.out.splitlines() if "$ " in line] == ["simulate"]
    reason, where = outcome.err.splitlines()
    assert reason.startswith("derain: demo/simulated: holds something other than")
    assert where == "All it said: demo/log.txt"


def test_the_streets_of_the_demo_have_rain_to_choose_by_and_to_test_on() -> None:
    options = dict(pairwise(STREETS))
    rates = tuple(map(float, STREETS[STREETS.index("--rain") + 1 :][:4]))
    campaign = Campaign(*partition(int(options["--sequences"])), rain_rates=rates)
    for part in ("validation", "test"):
        assert max(campaign.rain_rate[name] for name in campaign.split[part]) == max(rates)
    assert set(demo.DEMO_NETWORKS.values()) == {"outdet", "salsanext", "lisnownet"}


@pytest.fixture
def narrate(tmp_path: Path) -> Callable[..., list[str]]:
    """Has something told that prints what it is given."""

    def narrate(*texts: str) -> list[str]:
        transcript = Transcript(tmp_path / "log.txt")
        for text in texts:
            print(text, end="", file=transcript)
        return [transcript.progress, *transcript.said]

    return narrate


def test_bars_are_progress_and_lines_are_kept(narrate: Callable[..., list[str]]) -> None:
    bar = "Epoch {0}: {1:3}%|####  | 4/9 [00:01<00:02, 4.1it/s, val_iou=0.8]"
    texts = ["\rTraining: |    | 0/? [00:00<?, ?it/s]", "\r" + bar.format(0, 40), "\nbegins\n"]
    assert narrate(*texts, "\r" + bar.format(1, 80), "\x1b[A", "ends\n") == [
        "Epoch 1 80%",
        "begins",
    ]
    assert narrate("one\ntwo", " and\n", "three") == ["", "one", "two and"]


@pytest.mark.parametrize(("live", "before"), [(False, ""), (True, "\r\x1b[K")])
@pytest.mark.parametrize(
    ("bar", "steps", "epochs", "says"),
    [
        ("judging", 0, 0, "judging 40%"),
        ("judging", 4, 0, "step 1 of 4, judging 40%"),
        ("Epoch 7", 0, 0, "epoch 8 40%"),
        ("Epoch 7", 4, 20, "step 1 of 4, epoch 8 of 20 40%"),
        ("Validation DataLoader 0", 4, 20, "step 1 of 4, measuring 40%"),
    ],
)
def test_a_long_step_says_now_and_then_how_far_it_is(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    live: bool,
    before: str,
    bar: str,
    steps: int,
    epochs: int,
    says: str,
) -> None:
    told = threading.Event()

    class Screen(io.StringIO):
        def isatty(self) -> bool:
            return live

        def write(self, text: str) -> int:
            if says in text:
                told.set()
            return super().write(text)

    def slow(command: list[str]) -> int:
        print(f"\r{bar}:  40%|## | 4/10 [00:01<00:01]", end="", file=sys.stderr)
        assert told.wait(timeout=30)
        return 0

    monkeypatch.setattr(narration, "PERIODS", {True: 0.001, False: 0.001})
    monkeypatch.setattr(sys, "stdout", Screen())
    narrator = Narrator(slow, tmp_path / "log.txt", steps)
    narrator.step("tune", result=lambda _: "tuned", epochs=epochs)
    told_in_all = sys.stdout.getvalue()
    assert told_in_all.startswith("$ derain tune\n" + before)
    assert f"{before}  0:00  {says}" in told_in_all
    # On a terminal, what was only progress is wiped away.
    assert told_in_all.rpartition("\x1b[K")[2].splitlines()[-1].endswith("  tuned")
