"""Recordings are labelled by the answers of a method, and by nothing else."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from contents import contents
from recorded_scenes import write_scenes
from window_method import Between, Dimmer

from derain.annotation.manifest import CARD, LABELS, TAUGHT_MANIFEST, Manifest
from derain.annotation.teach import labels_of, teach
from derain.cards.card import load_card
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.files.labels import read_labels, write_labels
from derain.filters import DROR, FilterDerainer
from derain.scan import Scan
from derain.sources.folders import named_frames
from derain.sources.judgement import Judgement
from derain.sources.judging import judgements
from derain.sources.source import Frames, Source
from derain.sources.units import Division

POINTS = 200


@pytest.fixture
def drive(tmp_path) -> Path:
    """A recording of six scans."""
    return write_scenes(tmp_path / "drive/velodyne", *6 * [POINTS])


def of(drive: Path) -> Source:
    return named_frames([drive], labelled=True)


def test_labels_are_rain_not_rain_and_not_known() -> None:
    points = scene(6)
    points[4] = np.nan
    scan = Scan.of(points)
    rain = np.array([1, 0, 1, 0, 0, 1], bool)
    judged = np.array([1, 1, 1, 1, 1, 0], bool)
    known = np.array([1, 1, 0, 0, 1, 1], bool)
    judgement = Judgement(rain.astype(np.float32), rain, judged, scan, known=known)
    np.testing.assert_array_equal(labels_of(judgement), [1, 0, 255, 255, 255, 255])
    certain = Judgement(rain.astype(np.float32), rain, judged, scan)
    np.testing.assert_array_equal(labels_of(certain), [1, 0, 1, 0, 255, 255])


@pytest.mark.parametrize("make", [Between, lambda: FilterDerainer(DROR(), 1)])
def test_labels_are_the_answers_of_the_method(make, drive, tmp_path) -> None:
    out = tmp_path / "taught"
    manifest = teach(make(), of(drive), out).manifest
    keys = [scan.key for scan in manifest.scans]
    for frame, judgement, _ in judgements(make(), named_frames([drive])):
        assert (frame.key in keys) == bool(judgement.answered.any())
        if frame.key in keys:
            written = read_labels(out / LABELS / f"{frame.key}.label", POINTS)
            np.testing.assert_array_equal(written, labels_of(judgement))
    # Of the first and the last the method that looks before and after knows nothing.
    numbers = range(1, 5) if isinstance(make(), Between) else range(6)
    assert keys == [f"{number:06d}" for number in numbers]
    assert [scan.number for scan in manifest.scans] == [*numbers]
    assert manifest.scans[-1].part == "validation"
    assert Manifest.read(out).teacher == make().as_dict()
    assert {*contents(out)} == {CARD, TAUGHT_MANIFEST, *(f"{LABELS}/{key}.label" for key in keys)}


def test_the_card_explains_the_labels(drive, tmp_path) -> None:
    teach(Between(), of(drive), tmp_path / "plain")
    card = load_card(tmp_path / "plain" / CARD)
    assert (card.rain, card.unknown, {*card.classes}) == ((1,), (255,), {0, 1, 255})
    assert not card.has_statistics
    wads = load_card("wads")
    teach(Between(), of(drive), tmp_path / "wads", wads)
    card = load_card(tmp_path / "wads" / CARD)
    assert card.name == "WADS taught by between"
    assert (card.intensity_unit, card.deduplicate) == (wads.intensity_unit, wads.deduplicate)
    assert wads.licence in card.licence


def test_truth_changes_no_byte(drive, tmp_path) -> None:
    truth = drive.parent / LABELS
    for path in drive.iterdir():  # every tenth point is snow
        write_labels(truth / f"{path.stem}.label", np.where(np.arange(POINTS) % 10, 40, 110))
    teach(Between(), of(drive), tmp_path / "with")
    for file in truth.iterdir():
        file.write_bytes(b"garbage")
    teach(Between(), of(drive), tmp_path / "garbage")
    shutil.rmtree(truth)
    teach(Between(), of(drive), tmp_path / "without")
    assert (
        contents(tmp_path / "with")
        == contents(tmp_path / "garbage")
        == contents(tmp_path / "without")
    )


def test_labels_are_not_written_among_the_scans(drive) -> None:
    before = contents(drive.parent)
    with pytest.raises(InputError):
        teach(Between(), of(drive), drive.parent)
    assert contents(drive.parent) == before


@pytest.mark.parametrize("name", [CARD, TAUGHT_MANIFEST, f"{LABELS}/000000.label"])
def test_what_is_no_teachers_stays(drive, tmp_path, name) -> None:
    out = tmp_path / "out"
    (out / name).parent.mkdir(parents=True)
    (out / name).write_text("mine")
    with pytest.raises(InputError, match="exists, and `derain teach` did not write it"):
        teach(Between(), of(drive), out)
    assert contents(out) == {name: b"mine"}


def test_a_second_teaching_takes_the_place_of_the_first(drive, tmp_path) -> None:
    out = tmp_path / "taught"
    teach(Between(), of(drive), out)
    teach(FilterDerainer(DROR(), 1), of(drive)[:4], out)
    teach(FilterDerainer(DROR(), 1), of(drive)[:4], tmp_path / "alone")
    assert contents(out) == contents(tmp_path / "alone")


def test_records_of_labels_that_another_teaching_replaced_are_not_believed(drive, tmp_path) -> None:
    out, first = tmp_path / "taught", tmp_path / "first"
    recorded = Division(keep_records=True)
    teach(Between(), of(drive), first, division=recorded)
    for method, division in ((Between(), recorded), (FilterDerainer(DROR(), 1), None)):
        teach(method, of(drive), out, division=division)
    teach(Between(), of(drive), out, division=recorded)
    labels = [contents(folder / LABELS) for folder in (out, first)]
    assert labels[0] == labels[1]


@pytest.mark.parametrize("there", [True, False])
def test_what_fails_half_way_is_not_complete_until_it_is_taught_again(
    drive, tmp_path, there
) -> None:
    out, scan = tmp_path / "taught", drive / "000003.bin"
    teach(Between(), of(drive), tmp_path / "whole")
    if there:
        teach(FilterDerainer(DROR(), 1), of(drive), out)
    content = scan.read_bytes()
    scan.write_bytes(b"12345")
    with pytest.raises(InputError, match="000003"):
        teach(Between(), of(drive), out)
    with pytest.raises(InputError, match="its labels are not complete"):
        Manifest.read(out)
    scan.write_bytes(content)
    teach(Between(), of(drive), out)
    assert contents(out) == contents(tmp_path / "whole")


def test_what_is_interrupted_at_its_end_is_known(drive, tmp_path, monkeypatch) -> None:
    out = tmp_path / "taught"
    teach(Between(), of(drive), out)

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("derain.annotation.teach.write_card", interrupted)
        with pytest.raises(KeyboardInterrupt):
            teach(FilterDerainer(DROR(), 1), of(drive), out)
    with pytest.raises(InputError, match="its labels are not complete"):
        Manifest.read(out)
    teach(FilterDerainer(DROR(), 1), of(drive), out)
    assert Manifest.read(out).teacher["method"] == "dror"


def test_where_nothing_is_known_or_scans_are_in_no_file_no_labels_are_written(
    drive, tmp_path
) -> None:
    with pytest.raises(InputError, match="is sure of no point"):
        teach(Between(Dimmer(sure_within=0.0)), of(drive), tmp_path / "unsure")
    assert {*contents(tmp_path / "unsure")} == {TAUGHT_MANIFEST}
    in_memory = Frames.of_scans([Scan.of(scene(9), name="mine")] * 3)
    with pytest.raises(InputError, match="is not in a file"):
        teach(Between(), in_memory, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", [b"dir\xff/000000.bin", b"dir/\xff.bin"])
def test_a_name_that_the_manifest_could_not_hold_is_refused_before_any_work(tmp_path, name) -> None:
    scan = tmp_path / os.fsdecode(name)
    scan.parent.mkdir()
    scene(POINTS).tofile(scan)
    with pytest.raises(InputError, match="not UTF-8"):
        teach(FilterDerainer(DROR(), 1), named_frames(scan), tmp_path / "out")
    assert not (tmp_path / "out").exists()
