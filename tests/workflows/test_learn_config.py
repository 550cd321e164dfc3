"""Which network learns, and where the teacher's poses come from."""

from pathlib import Path

import numpy as np
import pytest

from derain.cards.card import load_card
from derain.errors import InputError
from derain.models import registry
from derain.models.checkpoint import save_model
from derain.models.outdet import OutDet
from derain.models.salsanext import SalsaNext
from derain.sources.folders import named_frames
from derain.sources.source import Source
from derain.workflows.learn_config import LearnConfig, Student, student_of


def write_scans(folder: Path, columns: int = 4) -> Source:
    folder.mkdir(parents=True)
    for number in range(3):
        np.ones((2, columns), np.float32).tofile(folder / f"{number}.bin")
    return named_frames([folder], ("x", "y", "z", "intensity")[:columns])


def config(scans: Path, **options: object) -> LearnConfig:
    return LearnConfig([scans], scans.parent / "out.onnx", **options)


def save_start(path: Path, channels: tuple[str, ...]) -> str:
    model = OutDet(neighbours=4, channels=channels)
    model.adopt(model.spec_for(load_card("wads")))
    save_model(model, path)
    return str(path)


def test_a_network_is_trained_by_its_configuration_without_intensity_where_it_is_blind(
    tmp_path,
) -> None:
    scans, dark = write_scans(tmp_path / "scans"), write_scans(tmp_path / "dark", columns=3)
    plain = Student("outdet", False, None, "outdet_taught.yaml", {}, 20)
    assert student_of(config(tmp_path / "scans", model="outdet"), scans) == plain
    asked = student_of(config(tmp_path / "scans", model="salsanext", blind=True), scans)
    assert (asked.config, asked.settings) == (
        "salsanext_taught.yaml",
        {"model.channels": "[range,x,y,z]"},
    )
    forced = student_of(config(tmp_path / "dark", model="outdet", epochs=3), dark)
    assert (forced.blind, forced.settings, forced.epochs) == (
        True,
        {"model.channels": "[x,y,z]"},
        3,
    )
    assert str(forced) == "outdet, blind to intensity"


def test_the_first_scan_that_can_be_read_shows_whether_there_are_intensities(tmp_path) -> None:
    scans = write_scans(tmp_path / "scans")
    (tmp_path / "scans/0.bin").write_bytes(b"damaged")
    assert student_of(config(tmp_path / "scans", model="outdet"), scans).sees_unit
    (tmp_path / "scans/1.bin").write_bytes(b"damaged")
    (tmp_path / "scans/2.bin").write_bytes(b"damaged")
    with pytest.raises(InputError, match=r"0\.bin"):
        student_of(config(tmp_path / "scans"), scans)


@pytest.mark.parametrize("columns", [3, 4])
def test_it_begins_with_the_model_of_derain_unless_another_is_named(tmp_path, columns) -> None:
    scans = write_scans(tmp_path / "scans", columns)
    unasked = student_of(config(tmp_path / "scans"), scans)
    settings = {"start": "default"}
    assert unasked == Student("cues", False, "default", "cues_taught.yaml", settings, 10)
    for asked in ({"model": "cues"}, {"model": "outdet"}, {"blind": True}):
        assert student_of(config(tmp_path / "scans", **asked), scans).start is None
    assert student_of(config(tmp_path / "scans", blind=True), scans).blind


def test_a_student_sees_what_its_start_sees(tmp_path) -> None:
    scans = write_scans(tmp_path / "scans")
    start = save_start(tmp_path / "mine.ckpt", ("range",))
    student = student_of(config(tmp_path / "scans", start=start), scans)
    assert (student.network, student.blind, student.settings) == ("outdet", True, {"start": start})
    assert str(student) == f"outdet, blind to intensity, started from {start}"


def test_cues_weigh_intensity_where_there_is_any_and_are_never_blind_to_it(tmp_path) -> None:
    scans, dark = write_scans(tmp_path / "scans"), write_scans(tmp_path / "dark", columns=3)
    for source in (scans, dark):
        student = student_of(config(tmp_path / "scans", model="cues"), source)
        assert (student.config, student.settings) == ("cues_taught.yaml", {})
    with pytest.raises(InputError, match="--blind: cues uses intensity"):
        student_of(config(tmp_path / "scans", model="cues", blind=True), scans)


def test_a_network_without_a_configuration_has_that_of_a_network_of_the_same_view(
    tmp_path, monkeypatch
) -> None:
    scans = write_scans(tmp_path / "scans")
    monkeypatch.setattr(registry, "NETWORKS", {"on_points": OutDet, "on_images": SalsaNext})
    points, images = (
        student_of(config(tmp_path / "scans", model=name), scans)
        for name in ("on_points", "on_images")
    )
    model = {"model": "derain.models.outdet.module.OutDet"}
    assert (points.config, points.settings) == ("outdet_taught.yaml", model)
    assert images.config == "salsanext_taught.yaml"


@pytest.mark.parametrize(
    ("channels", "columns", "options", "reason"),
    [
        (("x", "intensity"), 3, {}, "has no intensities, which"),
        (("x", "intensity"), 4, {"blind": True}, "sees intensity"),
        (("range",), 4, {"model": "salsanext"}, "is of outdet, from which salsanext"),
        (("range",), 4, {"folder": Path(".")}, "which this run clears first"),
    ],
)
def test_what_does_not_go_with_a_start_is_refused(
    tmp_path, monkeypatch, channels, columns, options, reason
) -> None:
    monkeypatch.chdir(tmp_path)
    scans = write_scans(tmp_path / "scans", columns)
    start = save_start(tmp_path / "mine.ckpt", channels)
    with pytest.raises(InputError, match=reason):
        student_of(config(tmp_path / "scans", start=start, **options), scans)


@pytest.mark.parametrize("recordings", ["drive", ["drive"], iter(["drive"])])
def test_paths_may_be_texts_and_one_recording_may_stand_alone(recordings) -> None:
    found = LearnConfig(recordings, "model.onnx", folder="work")
    assert [str(recording) for recording in found.recordings] == ["drive"]
    assert found.checkpoint == Path("work/student.ckpt")


def test_no_recording_is_refused() -> None:
    with pytest.raises(InputError, match="recordings"):
        LearnConfig([], Path("model.onnx"))


def test_a_training_without_an_epoch_is_refused() -> None:
    with pytest.raises(InputError, match="epochs"):
        LearnConfig([Path("drive")], Path("model.onnx"), epochs=0)
