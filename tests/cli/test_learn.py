"""From an unlabelled recording to a model and a report, in one command."""

import hashlib
from pathlib import Path

import lightning
import numpy as np
import pytest
from matplotlib.image import imread
from recorded_scenes import write_scenes
from recording_read_back import ReadBack

from derain.annotation.manifest import Manifest
from derain.annotation.teach import TeachResults
from derain.cards.card import load_card
from derain.evaluation.answers import Answers
from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer
from derain.files import read_scan
from derain.files.labels import read_labels, write_labels
from derain.learning.start import STARTED_FROM
from derain.models.checkpoint import save_model
from derain.models.outdet import OutDet
from derain.system.notices import warn
from derain.workflows import learn, learn_report

pytestmark = pytest.mark.usefixtures("here", "short_proof")

QUICK = ("--teacher", "dror", "--epochs", "1")


@pytest.fixture
def recording(here) -> Path:
    """Five scans of 600 points, a tenth of them drops."""
    return write_scenes(Path("drive/velodyne"), *5 * [600])


def weights(model: Path) -> str:
    """A hash of the network in a model, whatever its metadata."""
    import onnx

    graph = onnx.load(model).graph
    arrays = [onnx.numpy_helper.to_array(tensor).tobytes() for tensor in graph.initializer]
    return hashlib.sha256(b"".join(arrays)).hexdigest()


@pytest.mark.usefixtures("one_block")
def test_a_recording_becomes_a_model_and_a_report_whatever_its_labels(succeed, recording) -> None:
    lightning.seed_everything(0)
    start = OutDet(neighbours=4, channels=("range",))
    start.adopt(start.spec_for(load_card("wads")))
    save_model(start, Path("mine.ckpt"))
    work = Path("model_learning")
    command = ("learn", recording, "--out", "model.onnx", *QUICK, "--start", "mine.ckpt")
    outcome = succeed(*command)
    steps = [line.partition(":")[0] for line in outcome.out.splitlines()]
    assert [step for step in steps if step.istitle()][:3] == ["Teaching", "Training", "Export"]
    assert "(step 4 of 4)" in outcome.out
    derainer = Derainer("model.onnx")
    spec = derainer.spec
    # The student sees what its start saw.
    assert (spec.network, spec.channels, spec.view["neighbours"]) == ("outdet", ("range",), 4)
    assert spec.training[STARTED_FROM][0].startswith("mine.ckpt (")
    assert "taught by dror" in spec.data

    report = (work / "report.md").read_text()
    student = "The student: outdet, blind to intensity, started from mine.ckpt"
    for heading in ("Limits of the model", "The teacher: dror", student):
        assert f"## {heading}" in report
    assert "4 scans to learn from, 1 held out" in report
    assert "(held_out_1.png)" in report
    assert imread(work / "held_out_1.png")[..., :3].std() > 0
    # The share in the report is that of the model.
    removed = derainer(scene(600, seed=4)).mean()
    assert f"removes {removed:.1%} of the points" in report
    for step in ("teach dror", "fit --config outdet_taught.yaml", "export"):
        assert f"\n    derain {step} " in report
    assert "--start mine.ckpt" in report

    # Again, with labels beside the scans that are all wrong.
    without_labels = weights(Path("model.onnx"))
    for number in range(5):
        label = recording.parent / "labels" / f"{number:06d}.label"
        write_labels(label, np.where(np.arange(600) < 540, 110, 65535))
    (work / "left.txt").touch()
    outcome = succeed(*command, "--rerun", "report.rrd")
    # Last: if the recording cannot be shown, what was learnt is printed already.
    assert outcome.out.splitlines()[-1].startswith("report.rrd: ")
    assert weights(Path("model.onnx")) == without_labels
    assert not (work / "left.txt").exists()
    shows_teacher_and_student(ReadBack(Path("report.rrd")), recording, work)


def shows_teacher_and_student(found: ReadBack, recording: Path, work: Path) -> None:
    """The Rerun file holds the teacher's labels and the answers of the finished model."""
    teacher, student = found.points("/sensor/scan/teacher"), Derainer("model.onnx")
    removed = found.points("/sensor/methods/student/removed")
    for number in range(5):
        scan = read_scan(recording / f"{number:06d}.bin")
        labels = read_labels(work / f"taught/labels/{number:06d}.label", 600)
        np.testing.assert_array_equal(teacher[number], scan.xyz[(labels != 0) & scan.valid])
        np.testing.assert_array_equal(removed[number], scan.xyz[student(scan)])


def test_a_folder_of_something_else_is_not_cleared(refused, recording) -> None:
    mine = Path("mine/notes.txt")
    mine.parent.mkdir()
    mine.touch()
    line = refused("learn", recording, "--out", "model.onnx", "--work", "mine")
    assert "mine: holds files that no earlier run wrote" in line
    assert mine.exists()


@pytest.mark.parametrize(
    ("scans", "options", "names"),
    [
        (2, (), "2 scans: too few for training and validation"),
        (3, ("--teacher", "nobody"), "derain: nobody: no such method or file"),
        (3, ("--poses", "none.txt", "--teacher", "dror"), "none.txt"),
    ],
)
def test_what_cannot_be_learnt_from_is_refused_and_leaves_no_model_and_what_was_learnt_before(
    run_derain, recording, scans, options, names
) -> None:
    paths = sorted(recording.iterdir())[:scans]
    of_earlier_run = Path("model_learning/report.md")
    of_earlier_run.parent.mkdir()
    of_earlier_run.touch()
    (of_earlier_run.parent / learn.MARK).touch()
    outcome = run_derain("learn", *paths, "--out", "model.onnx", *options)
    assert outcome.code == 2
    assert names in outcome.err
    assert not Path("model.onnx").exists()
    assert of_earlier_run.exists()


def test_a_recording_of_which_too_few_scans_can_be_labelled_is_refused_with_the_reason(
    recording, monkeypatch, run_derain
) -> None:
    def teach(*_: object, **options: object) -> TeachResults:
        warn("2.bin: not to be trusted: it is of another place")
        return TeachResults(Manifest({"method": "dror"}), 5, Answers(), None)

    monkeypatch.setattr(learn, "teach", teach)
    outcome = run_derain("learn", recording, "--out", "model.onnx", "--teacher", "dror")
    assert outcome.code == 2
    assert "only 0 of 5 scans could be labelled" in outcome.err
    assert outcome.err.count("2.bin: not to be trusted: it is of another place") == 2


def test_a_clean_recording_is_refused_with_a_report_of_it(
    run_derain, recording, monkeypatch
) -> None:
    # A recording of which a filter finds nothing to be rain is hard to make up.
    monkeypatch.setattr(learn, "LEAST_RAIN", 1.0)
    monkeypatch.setattr(learn_report, "LEAST_RAIN", 1.0)
    outcome = run_derain("learn", recording, "--out", "model.onnx", *QUICK)
    assert outcome.code == 2
    assert "hardly any rain was found" in outcome.err
    assert "seems to be clean" in Path("model_learning/report.md").read_text()
    assert not Path("model.onnx").exists()
