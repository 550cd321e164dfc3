"""Clouds of bags as frames: read in order, out of it, by other processes, and by their paths."""

import pickle
import random
from collections.abc import Iterator

import numpy as np
import pytest
from small_bags import small_bag, storage_file, tables

from benchmarks.recorded_bags import (
    CLOUD_TYPE,
    PERIOD,
    POINTS,
    START,
    STORAGES,
    Recorded,
    Ros,
    table_of,
)
from derain.bags.bag import Bag, Message
from derain.errors import InputError
from derain.files.labels import write_labels
from derain.sources.folders import frame_of, named_frames

XYZI = ("x", "y", "z", "intensity")


@pytest.mark.parametrize("storage", STORAGES)
def test_frames_are_the_clouds_in_order(tmp_path, storage) -> None:
    bag = small_bag(tmp_path, storage)
    source = named_frames([bag])

    assert [frame.key for frame in source] == ["000000", "000001", "000002"]
    assert source[2].follows(source[1])
    assert {frame.sequence for frame in source} == {"drive"}
    source[1].read()
    taken = 1e-9 * (START - 1000 + PERIOD * np.arange(3))
    assert source[1].time == pytest.approx(taken[1], abs=1e-6)  # of the cloud that was read last
    assert [frame.time for frame in source] == pytest.approx(taken, abs=1e-6)
    assert len({frame.fingerprint() for frame in source}) == 3
    others = pickle.loads(pickle.dumps(source))  # as another process reads them
    assert others[0].fingerprint() == source[0].fingerprint()
    for frame, table in zip((*source, *others), 2 * tables(), strict=True):
        scan = frame.read()
        np.testing.assert_array_equal(np.column_stack([table[a] for a in "xyz"]), scan.xyz)
        np.testing.assert_array_equal(scan.intensity, table["intensity"])
        assert list(scan.fields) == [*XYZI, "ring"]
        np.testing.assert_array_equal(scan.fields["ring"], table["ring"])
        assert frame.count_points() == len(table)


@pytest.mark.parametrize("named", [".", "../drive", "inner/.."])
def test_a_bag_is_the_folder_that_a_command_runs_in(tmp_path, monkeypatch, named) -> None:
    bag = small_bag(tmp_path, "mcap")
    (bag / "inner").mkdir()
    write_labels(tmp_path / "drive.labels/000001.label", np.ones(len(tables()[1])))
    monkeypatch.chdir(bag)
    frames = named_frames(named, labelled=True)
    assert [frame.has_labels for frame in frames] == [False, True, False]
    assert {frame.sequence for frame in frames} == {"drive"}


def test_a_cloud_without_a_stamp_was_taken_when_it_was_recorded(tmp_path) -> None:
    ros = Ros("mcap")
    cloud = ros.cloud(tables(1)[0], 0)
    bag = small_bag(tmp_path, "mcap", clouds=[], more=[Recorded(POINTS, CLOUD_TYPE, START, cloud)])
    assert named_frames([bag])[0].time == pytest.approx(1e-9 * START, abs=1e-6)


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("period", [PERIOD, 0])
def test_any_order_gives_the_same_clouds_also_of_one_time(tmp_path, storage, period) -> None:
    ros, clouds = Ros(storage), tables(24, points=20)
    times = [START + number * period for number in range(24)]
    recorded = [
        Recorded(POINTS, CLOUD_TYPE, time, ros.cloud(cloud, time))
        for time, cloud in zip(times, clouds, strict=True)
    ]
    source = named_frames([small_bag(tmp_path, storage, clouds=[], more=recorded)])
    order = [23, 0, 12, 11, 12, 20, *range(24)]
    random.Random(1).shuffle(order)
    for number in order:
        np.testing.assert_array_equal(source[number].read().xyz[:, 0], clouds[number]["x"])


@pytest.mark.parametrize("first", [0, 15])
def test_what_lies_before_damage_is_read_and_not_again_for_each_cloud_behind_it(
    tmp_path, monkeypatch, first
) -> None:
    source = named_frames([small_bag(tmp_path, "mcap", clouds=tables(40, points=20))])
    whole, read = Bag.messages_of, []

    def up_to_damage(bag: Bag, *arguments: object) -> Iterator[Message]:
        for message in whole(bag, *arguments):
            if message.time >= START + 20 * PERIOD:
                raise InputError(bag.path, "is damaged", "Repair it.")
            read.append(message)
            yield message

    monkeypatch.setattr(Bag, "messages_of", up_to_damage)
    for frame in source[first:20]:
        frame.read()
    for frame in source[20:]:
        with pytest.raises(InputError, match="is damaged"):
            frame.read()
    assert len(read) <= 2 * 20


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_path_leads_into_a_bag(tmp_path, storage) -> None:
    bag = small_bag(tmp_path, storage)
    for path in (bag / "velodyne_points" / "000002", bag / "000002"):
        (frame,) = named_frames([path])
        assert frame.number == 2
        np.testing.assert_array_equal(frame.read().xyz[:, 0], tables()[2]["x"])
        assert frame_of(path).name == frame.name == str(bag / "velodyne_points" / "000002")
    for whole in (bag / "velodyne_points", storage_file(bag)):
        assert len(named_frames([whole])) == 3
    with pytest.raises(InputError, match="/velodyne_points has 3"):
        named_frames([bag / "000003"])


def test_a_folder_of_bags_stands_for_them(tmp_path) -> None:
    for name in ("b", "a"):
        small_bag(tmp_path, "ros1", name)
    source = named_frames([tmp_path])
    assert [frame.key for frame in source][2:4] == ["a/000002", "b/000000"]
    assert not source[3].follows(source[2])


def test_labels_lie_beside_the_bag(tmp_path) -> None:
    bag = small_bag(tmp_path, "ros1")
    label = np.arange(300) % 2
    write_labels(tmp_path / "drive.labels" / "000001.label", label)
    source = named_frames([bag], labelled=True)

    assert [frame.has_labels for frame in source] == [False, True, False]
    np.testing.assert_array_equal(source[1].read_label(300), label)
    assert not any(frame.has_labels for frame in named_frames([bag]))


def test_organised_big_endian_clouds_of_doubles_are_read(tmp_path) -> None:
    ros, (table,) = Ros("mcap"), tables(1)
    doubles = table_of({name: table[name].astype(">f8") for name in XYZI})
    cloud = ros.cloud(doubles, START, shape=(10, 30))
    bag = small_bag(tmp_path, "mcap", clouds=[], more=[Recorded(POINTS, CLOUD_TYPE, START, cloud)])
    scan = named_frames([bag])[0].read()

    assert scan.shape == (10, 30)
    np.testing.assert_array_equal(scan.xyz[:, 1], table["y"])
    np.testing.assert_array_equal(scan.intensity, table["intensity"])


@pytest.mark.parametrize(
    ("columns", "reason"),
    [
        ({"x": "f4", "y": "f4"}, "no x, y and z"),
        ({"x": "i2", "y": "i2", "z": "i2"}, "x is int16"),
        ({"x": "(2,)f4", "y": "f4", "z": "f4"}, "float32 of 2 values"),
    ],
)
def test_clouds_without_coordinates_are_refused(tmp_path, columns, reason) -> None:
    bag = small_bag(tmp_path, "mcap", clouds=[np.ones(4, list(columns.items()))])
    with pytest.raises(InputError, match=reason) as error:
        named_frames([bag])[0].read()
    assert str(error.value.subject).endswith("velodyne_points/000000")


def test_other_fields_on_the_way_are_warned_of_once(tmp_path, capsys) -> None:
    first, *others = tables(4)
    fewer = table_of({name: first[name] for name in "xyz"})
    source = named_frames([small_bag(tmp_path, "mcap", clouds=[fewer, *others])])
    intensities = [frame.read().intensity is None for frame in source]

    assert intensities == [True, False, False, False]
    printed = capsys.readouterr().err
    assert printed.count("its fields differ") == 1
    assert "000001" in printed


def test_what_is_passed_over_beside_bags_is_counted(tmp_path, capsys) -> None:
    small_bag(tmp_path, "mcap")
    (tmp_path / "scan.csv").touch()
    named_frames([tmp_path])
    assert f"{tmp_path}: 1 .csv passed over" in capsys.readouterr().err


def test_recordings_beside_bags_are_warned_of(tmp_path, capsys) -> None:
    small_bag(tmp_path, "mcap")
    named_frames([tmp_path])
    assert "other recording" not in capsys.readouterr().err
    (cut_off := tmp_path / "cut_off").mkdir()
    (cut_off / "cut_off_0.mcap").touch()  # the metadata are written when a recording ends
    assert len(named_frames([tmp_path])) == len(tables())
    warned = capsys.readouterr().err
    assert "1 other recording" in warned
    assert str(cut_off) in warned
