"""Where the scans and labels of a data set lie, and where the packaged data cards have them."""

from pathlib import Path

import pytest

from derain.cards.card import load_card, packaged_cards
from derain.cards.known import card_by_folders, known_layouts, label_of, label_places, lidar_folders
from derain.cards.layout import Layout, sequence_of
from derain.errors import InputError

REHEARSE3D = Layout(scans="lidar_radar_pcd", labels="lidar_radar_labels", lidar="innoviz")
CARD = "name: ours\nclasses: {0: dry, 1: wet}\nrain: [1]\n"


def test_a_card_names_where_its_scans_lie(tmp_path) -> None:
    (tmp_path / "ours.yaml").write_text(f"{CARD}layout: {{sequences: drives, labels: truth}}")
    layout = load_card(tmp_path / "ours.yaml").layout
    assert layout == Layout(sequences="drives", scans="velodyne", labels="truth", lidar="")


@pytest.mark.parametrize("name", ["''", "..", "a/b", "7"])
def test_a_folder_of_a_layout_is_one_name(tmp_path, name) -> None:
    (tmp_path / "ours.yaml").write_text(f"{CARD}layout: {{scans: {name}}}")
    with pytest.raises(InputError, match=r"ours\.yaml"):
        load_card(tmp_path / "ours.yaml")


def test_layouts_that_identify_a_card_go_first_and_lidar_folders_before_merged_ones() -> None:
    assert known_layouts()[0] == REHEARSE3D
    assert set(known_layouts()) == {load_card(name).layout for name in packaged_cards()}
    assert lidar_folders() == ("innoviz", "lidar_radar_pcd", "velodyne")


def test_folders_identify_no_more_than_their_card_allows() -> None:
    assert card_by_folders(REHEARSE3D, "rain").name == "REHEARSE-3D"
    assert card_by_folders(Layout(), "rain") is None
    assert card_by_folders(Layout(), "classes").name == "WADS"


@pytest.mark.parametrize(
    ("scan", "label"),
    [
        ("7/lidar_radar_pcd/3.bin", "7/lidar_radar_labels/3.label"),
        ("7/velodyne/3.bin.gz", "7/labels/3.label"),
        ("7/anything/3.5.pcd", "7/labels/3.5.label"),
    ],
)
def test_labels_are_looked_for_beside_the_folders_of_scans(tmp_path, scan, label) -> None:
    assert label_of(tmp_path / scan) == tmp_path / label
    assert tmp_path / label in label_places(tmp_path / scan)


@pytest.mark.parametrize("folder", ["lidar_radar_pcd", "velodyne", "anything"])
def test_labels_beside_a_scan_go_before_those_in_a_folder(tmp_path, folder) -> None:
    (tmp_path / folder).mkdir()
    (tmp_path / folder / "3.label").touch()
    assert label_of(tmp_path / folder / "3.bin") == tmp_path / folder / "3.label"


def test_labels_and_sequence_are_found_from_within_the_folder_of_scans(
    tmp_path, monkeypatch
) -> None:
    (tmp_path / "a/b").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "a/b")
    for scan in ("scan.bin", "../b/scan.bin", "./scan.bin"):
        found = Layout().label_of(Path(scan))
        assert found.absolute().resolve() == tmp_path / "a/labels/scan.label"
    assert Layout().label_of(Path("b/scan.bin")) == Path("labels/scan.label")
    assert sequence_of(Path("scan.bin")) == "a"
