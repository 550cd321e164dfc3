"""What a data set holds, counted by class and by rain rate."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgba

from derain.cards.layout import Layout
from derain.evaluation.contents import Contents, FrameCounting, find_sequences, rate_name
from derain.evaluation.hard_cases import scene
from derain.files import write_scan
from derain.files.labels import write_labels
from derain.pictures.data_statistics import CLEAN, statistics_figure
from derain.scan import Scan
from derain.simulation.campaign import MAKER
from derain.sources.folders import frame_of
from derain.sources.frame import Frame
from derain.sources.search import find_layout
from derain.sources.units import whole

REHEARSE3D = Layout(scans="lidar_radar_pcd", labels="lidar_radar_labels", lidar="innoviz")
OTHERS = Layout(scans="lidar", labels="classes")


def add_scan(sequence: Path, layout: Layout, stem: str, label: list[int]) -> None:
    write_scan(sequence / layout.scans / f"{stem}.bin", Scan.of(scene(len(label))))
    write_labels(sequence / layout.labels / f"{stem}.label", np.array(label))


def test_a_folder_of_scans_is_one_sequence_and_other_folders_have_to_be_named(tmp_path) -> None:
    write_scan(tmp_path / "scan.ply", Scan.of(scene(30)))
    ((frames, _),) = find_sequences(tmp_path, None)
    assert [frame.name for frame in frames] == [str(tmp_path / "scan.ply")]
    add_scan(tmp_path / "drive", OTHERS, "0", [1, 2])
    assert find_layout(tmp_path) is None
    ((frames, _),) = find_sequences(tmp_path, OTHERS)
    assert (frames[0].sequence, frames[0].key) == ("drive", "drive/0")


def test_the_manifest_states_rain_rates(tmp_path) -> None:
    for name in ("001", "000", ".003"):  # the last is not finished, and not counted
        add_scan(tmp_path / "sequences" / name, REHEARSE3D, "000000", [0])
    manifest = {"made_by": MAKER, "rain_rate_mm_h": {"000": 10.0}}
    (tmp_path / "manifest.json").write_text(json.dumps(manifest))
    assert [rate for _, rate in find_sequences(tmp_path, REHEARSE3D)] == [10, None]


def counted(frames: Sequence[Frame]) -> Contents:
    return Contents.from_json(FrameCounting().value(whole(frames)))


def test_points_are_counted_by_class_and_instances_are_not(tmp_path) -> None:
    add_scan(tmp_path, REHEARSE3D, "0", [3, 0, 3, 300, 7])
    path = tmp_path / "lidar_radar_labels/0.label"
    write_labels(path, np.array([3, 0, 3, 300, 7]), np.arange(5))
    ((frames, _),) = find_sequences(tmp_path, REHEARSE3D)
    contents = counted(frames)
    assert (contents.scans, contents.points) == (1, 5)
    assert contents.labelled == {0: 1, 3: 2, 7: 1, 300: 1}
    assert contents.as_dict({3: "rain", 0: "background", 7: "road"})["class_share"] == {
        "background": 0.2,
        "rain": 0.4,
        "road": 0.2,
        "class 300": 0.2,
    }
    path.unlink()
    unlabelled = counted([frame_of(frames[0].path)])
    assert (unlabelled.points, unlabelled.labelled.total()) == (5, 0)
    assert unlabelled.as_dict({})["class_share"] == {}


def test_the_picture_has_a_bar_for_each_class_and_rate_and_a_slice_for_each_rate() -> None:
    by_rate: dict[float | None, Contents] = {}
    for number, rate in enumerate((0.0, 10.0, 50.0, None)):
        by_rate[rate] = Contents(sequences=number + 1, scans=1, points=9)
        by_rate[rate].labelled.update({0: 5 + number, 3: 4})
    figure = statistics_figure(by_rate, {0: "background", 3: "rain"}, "data")
    figure.draw_without_rendering()
    shares, points = figure.axes
    angles = [wedge.theta2 - wedge.theta1 for wedge in shares.patches]
    assert np.abs(angles) == pytest.approx(np.arange(1, 5) * 36)
    assert points.get_yscale() == "log"
    counts = "".join(tick.get_text() for tick in points.get_yticklabels(which="both"))
    assert counts
    assert "$" not in counts
    assert [bar.get_height() for bar in points.patches] == [5, 4, 6, 4, 7, 4, 8, 4]
    assert [tick.get_text() for tick in points.get_xticklabels()] == ["background", "rain"]
    assert points.patches[0].get_facecolor() == to_rgba(CLEAN)
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == [rate_name(rate) for rate in by_rate]
    assert legend == ["clean", "10 mm/h", "50 mm/h", "rain unknown"]
