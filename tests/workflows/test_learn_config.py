"""Which network learns, and where the teacher's poses come from."""

from pathlib import Path

import numpy as np
import pytest

from derain.models import registry
from derain.models.outdet import OutDet
from derain.models.salsanext import SalsaNext
from derain.sources.folders import named_frames
from derain.workflows.learn_config import LearnConfig, epochs_of, network_settings

CONFIG = LearnConfig([Path("drive")], Path("out.onnx"), model="outdet")
BLIND = LearnConfig([Path("drive")], Path("out.onnx"), model="salsanext", blind=True)


def test_a_network_is_trained_by_its_configuration_without_intensity_if_blind() -> None:
    assert network_settings(CONFIG) == ("outdet_taught.yaml", {})
    blind = {"model.channels": "[range,x,y,z]"}
    assert network_settings(BLIND) == ("salsanext_taught.yaml", blind)
    assert epochs_of(CONFIG) == 20


def test_a_network_without_a_configuration_has_that_of_a_network_of_the_same_view(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    others = {"on_points": OutDet, "on_images": SalsaNext}
    monkeypatch.setattr(registry, "NETWORKS", others)

    def settings(network: str) -> tuple[str, dict[str, str]]:
        start = "mine.ckpt"
        return network_settings(LearnConfig([], Path("out.onnx"), model=network, start=start))

    model = "derain.models.outdet.module.OutDet"
    assert settings("on_points") == ("outdet_taught.yaml", {"model": model, "start": "mine.ckpt"})
    assert settings("on_images")[0] == "salsanext_taught.yaml"


def test_odometry_is_needed_where_there_are_no_poses(tmp_path: Path) -> None:
    folder = tmp_path / "drive/velodyne"
    folder.mkdir(parents=True)
    for number in range(3):
        np.zeros((2, 4), np.float32).tofile(folder / f"{number}.bin")

    def needed(teacher: str, poses: str | None) -> bool:
        config = LearnConfig([folder], Path("out.onnx"), teacher=teacher, poses=poses)
        return config.needs_odometry(named_frames([folder]))

    given = [("persistence", poses) for poses in (None, "standing", "poses.txt", "odometry")]
    assert [needed(*each) for each in [*given, ("dror", None)]] == [True, False, False, True, False]
    (tmp_path / "drive/poses.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n" * 3)
    assert [needed(*each) for each in given] == [False, False, False, True]
