"""From an unlabelled recording to a model and a report, in one command."""

import hashlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from recording_read_back import ReadBack

from derain.cli import learn, learning_report, learning_text, narration
from derain.cli.lesson import Lesson
from derain.cli.training import train
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export import onnx_file
from derain.export.runtime import Derainer
from derain.files import read_scan
from derain.files.labels import read_labels, write_labels
from derain.scan import Scan
from derain.system.notices import warn
from derain.teaching.manifest import Manifest, TaughtScan

QUICK = ("--teacher", "dror", "--epochs", "1")


@pytest.fixture(autouse=True)
def _quickly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    # How far a step is has a test of its own, and so has the whole proof.
    monkeypatch.setattr(narration, "PERIODS", {True: 3600, False: 3600})
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: [("scene", Scan.of(scene(100)))])


WriteRecording = Callable[..., Path]


@pytest.fixture
def write() -> WriteRecording:
    """Writes a recording of some scans of 600 points, a tenth of them drops."""

    def write(folder: str = "drive", scans: int = 5, points: int = 600) -> Path:
        Path(folder, "velodyne").mkdir(parents=True)
        for number in range(scans):
            scene(points, seed=number).tofile(Path(folder, "velodyne", f"{number:06d}.bin"))
        return Path(folder, "velodyne")

    return write


def weights(model: Path) -> str:
    """What the network of a model is, whatever else the file says."""
    import onnx

    graph = onnx.load(model).graph
    arrays = [onnx.numpy_helper.to_array(tensor).tobytes() for tensor in graph.initializer]
    return hashlib.sha256(b"".join(arrays)).hexdigest()


@pytest.mark.usefixtures("one_block")
def test_a_recording_becomes_a_model_and_a_report_whatever_its_labels_say(
    run_derain, write: WriteRecording
) -> None:
    recording, work = write(), Path("model_learning")
    command = ("learn", recording, "--out", "model.onnx", *QUICK)
    outcome = run_derain(*command)
    assert outcome.code == 0, outcome.err
    commands = [line.split()[2] for line in outcome.out.splitlines() if line.startswith("$ ")]
    assert commands == ["teach", "fit", "export"]
    derainer = Derainer("model.onnx")
    assert derainer.spec.network == "outdet"
    assert "taught by dror" in derainer.spec.data

    report = (work / "report.md").read_text()
    for heading in ("What could not be learnt", "The teacher: dror", "The student: outdet"):
        assert f"## {heading}" in report
    assert "4 scans to learn from, 1 held out" in report
    for name in ("teacher", "removed", "held_out_1", "held_out_1_beside"):
        assert f"({name}.png)" in report
        assert imread(work / f"{name}.png")[..., :3].std() > 0
    assert "Beside the labels" not in report
    # What the report says is removed is what the model removes.
    removed = derainer(scene(600, seed=4)).mean()
    assert f"removes {removed:.1%} of their points" in report

    # Again, with labels beside the scans that are all wrong, and asked to measure by them.
    without_labels = weights(Path("model.onnx"))
    for number in range(5):
        label = recording.parent / "labels" / f"{number:06d}.label"
        write_labels(label, np.where(np.arange(600) < 540, 110, 65535))
    (work / "left.txt").touch()
    outcome = run_derain(*command, "--card", "wads", "--rerun", "report.rrd")
    assert outcome.code == 0, outcome.err
    assert weights(Path("model.onnx")) == without_labels
    assert "Nothing could be measured" in (work / "report.md").read_text()
    assert not (work / "left.txt").exists()
    shows_teacher_and_student(ReadBack(Path("report.rrd")), recording, work)


def shows_teacher_and_student(found: ReadBack, recording: Path, work: Path) -> None:
    """What the viewer is given is what the teacher's labels and the finished model say."""
    teacher, student = found.points("/sensor/scan/teacher"), Derainer("model.onnx")
    removed = found.points("/sensor/methods/student/removed")
    probability = found.points("/sensor/methods/student/probability")
    assert list(teacher) == list(removed) == list(range(5))
    for number in range(5):
        scan = read_scan(recording / f"{number:06d}.bin")
        labels = read_labels(work / f"taught/labels/{number:06d}.label", 600)
        np.testing.assert_array_equal(teacher[number], scan.xyz[(labels != 0) & scan.valid])
        np.testing.assert_array_equal(removed[number], scan.xyz[student(scan)])
        probable = student.probability(scan) >= 0.01
        np.testing.assert_array_equal(probability[number], scan.xyz[probable])
        shares = {
            "/share/scan/teacher": labels == 1,
            "/share/scan/teacher_not_known": labels == 255,
            "/share/methods/student": student(scan),
        }
        for entity, part in shares.items():
            share = 100 * (part & scan.valid).sum() / scan.valid.sum()
            assert found.numbers(entity)[number] == pytest.approx(share)
    captions = found.values("/caption", "TextDocument:text")
    assert [number for number, text in captions.items() if ", held out" in text[0]] == [4]


def test_a_folder_of_something_else_is_not_cleared(run_derain, write: WriteRecording) -> None:
    mine = Path("mine/notes.txt")
    mine.parent.mkdir()
    mine.touch()
    outcome = run_derain("learn", write(), "--out", "model.onnx", "--work", "mine")
    assert outcome.code == 2
    assert "mine: holds something other than what an earlier run left" in outcome.err
    assert mine.exists()


@pytest.mark.parametrize(
    ("scans", "options", "says"),
    [
        (1, (), "1 scan: too few to learn from some and choose by others"),
        (2, (), "2 scans: too few"),
        (3, ("--teacher", "nobody"), "derain: nobody: no such file"),
        (3, ("--poses", "none.txt", "--teacher", "dror"), "none.txt"),
    ],
)
def test_what_cannot_be_learnt_from_is_told_and_leaves_no_model(
    run_derain, write: WriteRecording, scans: int, options: tuple[str, ...], says: str
) -> None:
    outcome = run_derain("learn", write(scans=scans), "--out", "model.onnx", *options)
    assert outcome.code == 2
    assert says in outcome.err
    assert not Path("model.onnx").exists()


def test_scans_that_nothing_connects_are_refused_with_the_reason(run_derain) -> None:
    recording = Path("drives")
    recording.mkdir()
    for number in range(3):
        places = np.random.default_rng(number).uniform(-40, 40, (3000, 3)).astype(np.float32)
        np.column_stack([places, places[:, :1] * 0]).tofile(recording / f"{number:06d}.bin")
    outcome = run_derain("learn", recording, "--out", "model.onnx")
    assert outcome.code == 2
    assert "no two scans of the recording could be laid upon one another" in outcome.err
    assert "3 scans could not be registered" in outcome.err
    assert not Path("model.onnx").exists()


def test_a_recording_of_which_too_few_scans_can_be_labelled_is_refused_with_the_reason(
    write: WriteRecording, monkeypatch: pytest.MonkeyPatch, run_derain
) -> None:
    recording = write(scans=5)
    known = [TaughtScan(name, recording / f"{name}.bin", "", 0, "train") for name in "ab"]

    def run(command: list[str]) -> int:
        if command[0] == "odometry":
            warn("2.bin: not to be trusted: it is of another place")
            print("poses.txt: 5 scans, 1 not to be trusted")
        else:
            Manifest({"method": "persistence"}, known).write(Path("model_learning/taught"))
        return 0

    monkeypatch.setattr(
        learn, "Narrator", lambda _, log, steps: narration.Narrator(run, log, steps)
    )
    outcome = run_derain("learn", recording, "--out", "model.onnx")
    assert outcome.code == 2
    assert "only 2 of 5 scans could be labelled" in outcome.err
    assert "2.bin: not to be trusted: it is of another place" in outcome.err


def test_a_clean_recording_is_refused_with_a_report_of_it(
    run_derain, write: WriteRecording, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A recording of which a filter finds nothing to be rain is hard to make up.
    monkeypatch.setattr(learning_report, "LEAST_RAIN", 1.0)
    monkeypatch.setattr(learning_text, "LEAST_RAIN", 1.0)
    outcome = run_derain("learn", write(), "--out", "model.onnx", *QUICK)
    assert outcome.code == 2
    assert "hardly any rain was found" in outcome.err
    assert "seems to be clean" in Path("model_learning/report.md").read_text()
    assert not Path("model.onnx").exists()


@pytest.mark.parametrize(
    ("options", "columns", "fitted_with"),
    [
        ((), 4, ["outdet_taught.yaml"]),
        (("--blind", "--model", "salsanext"), 4, ["salsanext_taught.yaml", "[range,x,y,z]"]),
        (("--columns", "x,y,z"), 3, ["outdet_taught.yaml", "[x,y,z]"]),
    ],
)
def test_the_student_is_what_was_asked_for(
    run_derain,
    write: WriteRecording,
    monkeypatch: pytest.MonkeyPatch,
    options: tuple[str, ...],
    columns: int,
    fitted_with: list[str],
) -> None:
    recording = write(scans=3)
    for scan in recording.iterdir():
        np.fromfile(scan, np.float32).reshape(-1, 4)[:, :columns].copy().tofile(scan)
    trained: list[list[str]] = []
    monkeypatch.setattr(train, "train", lambda arguments: trained.append(arguments) or 1 / 0)
    with pytest.raises(ZeroDivisionError):
        run_derain("learn", recording, "--out", "model.onnx", *QUICK, *options)
    (arguments,) = trained
    assert [word for word in arguments if ".yaml" in word or word.startswith("[")] == fitted_with
    assert not Path("model.onnx").exists()


@pytest.mark.parametrize(
    ("teacher", "recordings", "options", "asked"),
    [
        ("persistence", 1, (), True),
        ("persistence", 1, ("--poses", "standing"), False),
        ("persistence", 1, ("--poses", "odometry"), True),
        ("persistence", 1, ("--poses", "poses.txt"), False),
        ("persistence", 2, (), True),
        ("dror", 1, (), False),
    ],
)
def test_odometry_is_asked_where_nobody_says_where_the_sensor_was(
    write: WriteRecording,
    monkeypatch: pytest.MonkeyPatch,
    run_derain,
    teacher: str,
    recordings: int,
    options: tuple[str, ...],
    asked: bool,
) -> None:
    folders = [write(f"drive{number}", scans=3) for number in range(recordings)]
    commands: list[list[str]] = []

    def run(command: list[str]) -> int:
        commands.append(command)
        return 2

    monkeypatch.setattr(learn, "Narrator", lambda _, log, steps: narration.Narrator(run, log))
    outcome = run_derain("learn", *folders, "--out", "model.onnx", "--teacher", teacher, *options)
    assert outcome.code == 2
    assert commands[0][0] == ("odometry" if asked else "teach")
    assert not Path("model.onnx").exists()


def test_poses_beside_the_scans_are_taken(
    write: WriteRecording, monkeypatch: pytest.MonkeyPatch, run_derain
) -> None:
    recording = write(scans=3)
    recording.with_name("poses.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n" * 3)
    monkeypatch.setattr(
        learn, "Narrator", lambda _, log, steps: narration.Narrator(commands.append, log)
    )
    commands: list[list[str]] = []
    monkeypatch.setattr(learn, "_fit", None)
    with pytest.raises(InputError, match="taught"):
        learn.learn(Lesson([recording], Path("model.onnx"), Path("work")))
    assert [command[0] for command in commands] == ["teach"]
