"""A method is found by its name, or what is wrong with the name is said in one line."""

import errno
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from derain.errors import InputError
from derain.export.methods import load_method
from derain.files.reading import is_file

KEPT = Path(__file__).parent / "kept"


def test_a_checkpoint_is_to_be_exported_first() -> None:
    with pytest.raises(
        InputError, match=r"outdet\.ckpt: a checkpoint, .* Export it first: "
    ) as error:
        load_method(str(KEPT / "outdet.ckpt"), {})
    assert f"`derain export {KEPT}/outdet.ckpt --out {KEPT}/outdet.onnx`" in str(error.value)


def test_a_checkpoint_that_is_not_there_is_missing_first_of_all() -> None:
    with pytest.raises(InputError, match=r"none\.ckpt: no such file"):
        load_method("none.ckpt", {})


def test_a_name_too_long_for_a_file_is_one_line() -> None:
    with pytest.raises(InputError, match=r"cannot be read .*too long"):
        is_file(Path("x" * 5000))


@pytest.fixture
def closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder that may not be searched, whoever runs the tests."""
    folder = tmp_path / "closed"

    def refusing(method: Callable[..., Any]) -> Callable[..., Any]:
        def ask(path: Path, *arguments: Any, **options: Any) -> Any:
            if folder in path.parents:
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
            return method(path, *arguments, **options)

        return ask

    for name in ("stat", "open"):
        monkeypatch.setattr(Path, name, refusing(getattr(Path, name)))
    return folder


@pytest.mark.parametrize("command", ["run", "bench", "export", "import-weights"])
def test_a_model_in_a_folder_that_may_not_be_searched_is_one_line(
    run_derain, closed: Path, tmp_path: Path, command: str
) -> None:
    scan = tmp_path / "scan.bin"
    scan.write_bytes(bytes(16))
    options: dict[str, list[object]] = {
        "run": [closed / "a.onnx", scan],
        "bench": ["--data", scan, "--card", "wads", "--methods", closed / "a.onnx"],
        "export": [closed / "a.ckpt"],
        "import-weights": ["outdet", closed / "a.pt", "--stats", "wads"],
    }
    outcome = run_derain(command, *options[command], "--out", tmp_path / "out.onnx")
    assert (outcome.code, outcome.out) == (2, "")
    (line,) = outcome.err.splitlines()
    assert line.startswith(f"derain: {closed}/a.")
    assert "cannot be read (Permission denied)" in line
    assert not (tmp_path / "out.onnx").exists()
