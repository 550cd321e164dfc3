"""Labelled scans are found however a user names them, and measured by the right card."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from derain.cards.card import load_card
from derain.cards.layout import Layout, sequence_of
from derain.datamodules.base import Loading
from derain.datamodules.labelled import card_of, labelled_scans, rain_rates
from derain.errors import InputError
from derain.simulation.campaign import MAKER

Write = Callable[..., None]


def in_sequences(root: Path, write: Write, scans: str, labels: str, *names: str) -> Path:
    for name in names:
        folder = root / "sequences" / name
        write(folder / scans / "0.bin", folder / labels / "0.label", [0, 3])
    return root


@pytest.fixture
def simulated(tmp_path, write) -> Path:
    """A simulated data set of three sequences."""
    root = in_sequences(
        tmp_path / "set", write, "lidar_radar_pcd", "lidar_radar_labels", "000", "001", "002"
    )
    split = {"train": ["000"], "validation": ["001"], "test": ["002"]}
    manifest = {"made_by": MAKER, "split": split, "rain_rate_mm_h": {"000": 0.0, "002": 25.0}}
    (root / "manifest.json").write_text(json.dumps(manifest))
    return root


def found(paths: list[Path], card: str, part: str = "test") -> list[str]:
    data = labelled_scans(paths, load_card(card), Loading())
    return [str(frame.label_path.relative_to(paths[0].parent)) for frame in data.frames(part)]


def test_files_and_folders_are_taken_with_the_labels_beside_them(tmp_path, write) -> None:
    write(tmp_path / "a/single.bin", tmp_path / "a/single.label")
    for frame in ("1", "0"):
        write(tmp_path / f"velodyne/{frame}.bin", tmp_path / f"labels/{frame}.label")
    paths = [tmp_path / "a/single.bin", tmp_path / "velodyne"]
    data = labelled_scans(paths, load_card("kitti"), Loading())
    assert [frame.label_path for frame in data.frames("test")] == [
        tmp_path / "a/single.label",
        tmp_path / "labels/0.label",
        tmp_path / "labels/1.label",
    ]


def test_labels_that_lie_elsewhere_are_found_by_the_card_that_the_message_shows(
    tmp_path, write
) -> None:
    write(tmp_path / "drive/0.bin", tmp_path / "truth/0.label")
    with pytest.raises(InputError, match="its labels are not at") as refusal:
        found([tmp_path / "drive"], "kitti")
    (layout,) = re.findall(r"layout: (\{.*\})", refusal.value.remedy)
    names = yaml.safe_load(layout.replace("FOLDER", "truth"))
    card = replace(load_card("kitti"), layout=Layout(**names))
    (frame,) = labelled_scans([tmp_path / "drive"], card, Loading()).frames("test")
    assert frame.label_path == tmp_path / "truth/0.label"


def test_a_simulated_data_set_brings_its_split_its_card_and_its_rain(simulated) -> None:
    for part, name in {"train": "000", "validation": "001", "test": "002"}.items():
        labels = f"set/sequences/{name}/lidar_radar_labels/0.label"
        assert found([simulated], "simulated", part) == [labels]
    assert card_of([simulated], None) == load_card("simulated")
    assert card_of([Path("example")], None) == load_card("simulated")
    assert rain_rates([simulated], None) == {"000": 0.0, "002": 25.0}


def test_rehearse3d_is_known_by_its_folders_and_anything_else_needs_a_card(tmp_path, write) -> None:
    rehearse3d = in_sequences(tmp_path / "r", write, "lidar_radar_pcd", "lidar_radar_labels", "005")
    assert card_of([rehearse3d], None) == load_card("rehearse3d")
    assert card_of([rehearse3d], "simulated") == load_card("simulated")
    other = in_sequences(tmp_path / "o", write, "velodyne", "labels", "08", "09")
    assert len(found([other], "kitti", "validation")) == 2  # by the split of the card
    with pytest.raises(InputError, match=r"which labels are rain\. Give --card: "):
        card_of([other], None)


def test_a_root_whose_sequences_hold_no_scans_is_refused(tmp_path) -> None:
    (tmp_path / "sequences/00/other").mkdir(parents=True)
    with pytest.raises(InputError, match=r"00/velodyne: no such folder.* layout of its data card"):
        labelled_scans([tmp_path], load_card("kitti"), Loading()).source("train")


def test_rain_rates_are_read_by_the_name_of_the_sequence(tmp_path) -> None:
    rates = tmp_path / "rates.yaml"
    rates.write_text('"005": 25\n"010": 10.5\n')
    known = rain_rates([tmp_path], rates)
    assert known == {"005": 25.0, "010": 10.5}
    assert known[sequence_of(Path("sequences/010/lidar_radar_pcd/000000.bin"))] == 10.5


@pytest.mark.parametrize("text", ["010: 25", '"010": heavy', '"010": -5', "- 25", ""])
def test_what_is_no_file_of_rain_rates_is_refused(tmp_path, text) -> None:
    rates = tmp_path / "rates.yaml"
    rates.write_text(text)
    with pytest.raises(InputError, match=r"rates\.yaml: "):
        rain_rates([tmp_path], rates)


def test_a_card_names_where_the_labels_of_sequences_and_of_scans_lie(tmp_path, write) -> None:
    layout = Layout(sequences="drives", scans="lidar", labels="truth")
    card = replace(load_card("kitti"), layout=layout, split={"test": ["b"]})
    drives = tmp_path / "drives"
    for name in ("a", "b"):
        write(drives / name / "lidar/0.bin", drives / name / "truth/0.label")
    for path, names in ((tmp_path, "b"), (drives, "ab")):
        frames = labelled_scans([path], card, Loading()).frames("test")
        labels = [drives / name / "truth/0.label" for name in names]
        assert [frame.label_path for frame in frames] == labels


def test_a_data_set_is_named_alone(simulated, tmp_path) -> None:
    for paths in ([simulated, simulated], [tmp_path, simulated]):
        with pytest.raises(InputError, match="is a data set"):
            labelled_scans(paths, load_card("simulated"), Loading())


def test_a_part_of_a_simulated_data_set_is_known_as_simulated(simulated) -> None:
    part = simulated / "sequences/002"
    assert card_of([part], None) == load_card("simulated")
    assert rain_rates([part], None)["002"] == 25.0
    assert found([part], "simulated") == ["002/lidar_radar_labels/0.label"]
