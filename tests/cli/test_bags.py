"""Commands that read bags: they print what is in one, draw, teach and measure by its clouds."""

import json

import numpy as np
import pytest
from small_bags import small_bag, tables

from benchmarks.recorded_bags import CLOUD_TYPE, START, STORAGES, Recorded, Ros


@pytest.mark.parametrize("storage", STORAGES)
def test_info_prints_what_is_in_a_bag(tmp_path, storage, run_derain) -> None:
    bag = small_bag(tmp_path, storage)
    facts = json.loads(run_derain("info", bag, "--json").out)

    assert (facts["bag"], facts["messages"], facts["seconds"]) == (storage, 12, 0.3)
    assert facts["from"] == "2023-11-14T22:13:20.023+00:00"
    assert facts["topics"]["/imu/data"] == "sensor_msgs/msg/Imu, 6 messages"
    clouds = facts["point clouds"]["/velodyne_points"]
    assert clouds["points of the first"] == 300
    assert clouds["fields"]["ring"] == "u2 at 16"
    assert "/velodyne_points" in run_derain("info", bag).out
    cloud = json.loads(run_derain("info", bag / "000002", "--json").out)
    assert cloud["points"] == 300


def test_a_topic_is_named_by_an_option(tmp_path, run_derain) -> None:
    ros, (table,) = Ros("mcap"), tables(1)
    rear = Recorded("/rear", CLOUD_TYPE, START + 5, ros.cloud(table[:200], START))
    bag = small_bag(tmp_path, "mcap", more=[rear])

    command = ("run", "ror", bag, "--out", tmp_path / "out")
    assert "--topic" in run_derain(*command).err
    outcome = run_derain(*command, "--topic", "/rear")
    assert (outcome.code, "rear/000000: 200 points" in outcome.out) == (0, True)
    assert json.loads(run_derain("info", bag, "--json", "--topic", "rear").out)["points"] == 200
    outcome = run_derain(*command, "--topic", "/x")
    assert (outcome.code, "/rear" in outcome.err) == (2, True)


def test_view_draws_the_cloud_that_is_named_or_the_first(tmp_path, succeed) -> None:
    bag, picture = small_bag(tmp_path, "mcap"), tmp_path / "figure.png"
    command = ["view", "--methods", "ror", "--out", picture]
    assert "is drawn" not in succeed(*command, bag / "000001").out
    printed = succeed(*command, bag).out
    assert f"{bag}/velodyne_points/000000 is drawn, the first of 3 clouds" in printed
    assert picture.stat().st_size > 10_000


def test_a_bag_has_the_weather_of_its_scans_as_files(tmp_path, succeed) -> None:
    clouds, files = tables(points=2000), tmp_path / "files"
    files.mkdir()
    for number, cloud in enumerate(clouds):
        np.save(files / f"{number}.npy", cloud)
    weather = []
    for source in (small_bag(tmp_path, "mcap", clouds=clouds), files):
        options = ("--out", tmp_path / f"of_{source.name}", "--json", "--hold", "2")
        lines = succeed("run", "dror", source, *options).out.splitlines()
        weather.append([json.loads(line)["weather"] for line in lines])
    assert len(weather[0]) == len(clouds)
    assert weather[0] == weather[1]
    assert all(one["met_rain"] for one in weather[0])
