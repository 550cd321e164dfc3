"""``--runtime`` and ``--precision``: what cannot be meant is one line, before any work."""

import sys
from pathlib import Path

import pytest

from derain.evaluation.hard_cases import scene

KEPT = Path(__file__).parent.parent / "export/kept"
COMMANDS = {
    "run": ["run", KEPT / "outdet.onnx", "{scan}", "--out", "{out}"],
    "bench": [
        *("bench", "--data", "{scan}", "--card", "wads", "--methods", KEPT / "outdet.onnx"),
        *("--out", "{out}"),
    ],
    "export": ["export", KEPT / "outdet.ckpt", "--out", "{out}.onnx"],
}


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    path = tmp_path / "scan.bin"
    scene(100).tofile(path)
    path.with_suffix(".label").write_bytes(bytes(400))
    return path


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    ("options", "line"),
    [
        (["--runtime", "abacus"], "abacus: no such runtime. Give onnxruntime or openvino."),
        (
            ["--precision", "bf16"],
            "precision bf16: onnxruntime computes in float32. "
            "Leave it out, or take the runtime openvino.",
        ),
    ],
)
def test_a_runtime_or_precision_that_there_is_not_is_one_line(
    run_derain, scan: Path, tmp_path: Path, command: str, options: list[str], line: str
) -> None:
    places = {"scan": scan, "out": tmp_path / "out"}
    words = [str(word).format(**places) for word in COMMANDS[command]]
    outcome = run_derain(*words, *options)
    assert (outcome.code, outcome.out, outcome.err) == (2, "", f"derain: {line}\n")
    assert not list(tmp_path.glob("out*"))


@pytest.mark.parametrize("command", ["run", "bench"])
def test_openvino_that_is_not_installed_is_one_line(
    run_derain, scan: Path, tmp_path: Path, command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "openvino", None)  # importing it is an ImportError
    places = {"scan": scan, "out": tmp_path / "out"}
    words = [str(word).format(**places) for word in COMMANDS[command]]
    outcome = run_derain(*words, "--runtime", "openvino")
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err.endswith("not installed. pip install 'derain[openvino]'\n")
    assert not (tmp_path / "out").exists()
