"""Every reader survives damaged files; the fuzzer sees what does not."""

import shutil

import pytest
from broken_readers import readers

from benchmarks.fuzz import main
from benchmarks.fuzzing import scans
from benchmarks.fuzzing.formats import INPUTS
from benchmarks.fuzzing.worker import Worker
from derain.files.format import FORMATS


def test_every_reader_reads_refuses_and_never_breaks(
    onnx_model, checkpoint, tmp_path, capsys
) -> None:
    models = tmp_path / "models"
    models.mkdir()
    shutil.copy(onnx_model, models)
    shutil.copy(checkpoint, models)
    options = ["--models", str(models), "--out", str(tmp_path / "findings")]
    code = main(["--inputs", "400", "--seed", "0", *options])
    table = capsys.readouterr().out
    assert code == 0, table
    rows = [line.split() for line in table.splitlines()[1:]]
    assert {"bin", "npy", "npz", "pcd", "ply", "csv", "label", "card", "onnx", "ckpt"} <= {
        row[0] for row in rows
    }
    for name, inputs, right, refused, findings, _ in rows:
        assert int(right.replace(",", "")) > 0, name
        assert int(refused.replace(",", "")) > 0, name
        assert int(right) + int(refused) == int(inputs)
        assert findings == "0"


@pytest.mark.parametrize("suffix", FORMATS)
def test_every_format_has_hostile_and_sound_files_in_the_fuzzer(suffix) -> None:
    assert suffix in INPUTS, f"add {suffix} to benchmarks/fuzzing/formats.py"
    extra = FORMATS[suffix].EXTRA
    if extra is not None and not extra.installed:
        pytest.skip(f"{extra.library} is not installed")
    (reader,) = [reader for reader in scans.readers() if reader.file == f"scan{suffix}"]
    assert reader.seeds()
    assert len({make() for make in reader.hostile}) == len(reader.hostile) > 0


@pytest.mark.parametrize(
    ("reader", "found"),
    [
        ("sound", None),
        ("raises", "KeyError at broken_readers.py"),
        ("believes", "AssertionError at broken_readers.py"),
        ("aborts", "ended the process (-6)"),
        ("crashes", "ended the process (-11)"),
        ("hoards", "1,"),  # MB
        ("speaks", "a message of"),
        ("refuses", "refused, though nothing is wrong with it"),
    ],
)
def test_whatever_is_wrong_with_a_reader_is_found(worker, reader, found) -> None:
    whole, damaged = worker.judge(reader, range(2))
    assert (whole.number, damaged.number) == (0, 1)
    if reader == "refuses":
        whole, damaged = damaged, whole
    assert not whole.is_finding
    assert damaged.is_finding == (found is not None)
    assert damaged.verdict.startswith(found or "refused"), damaged.verdict


@pytest.fixture(scope="module")
def worker(tmp_path_factory) -> Worker:
    """Judges the readers that are broken."""
    made = Worker(0, tmp_path_factory.mktemp("worker"), readers)
    yield made
    made.end()


def test_an_input_is_the_same_whatever_came_before_it() -> None:
    reader = readers()["sound"]
    inputs = [reader.content(0, number) for number in range(50)]
    assert [readers()["sound"].content(0, number) for number in reversed(range(50))] == inputs[::-1]
    assert [reader.content(1, number) for number in range(50)] != inputs
    assert len(set(inputs)) > 40
