"""A method is found by its name, or what is wrong with the name is said in one line."""

import errno
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from derain.errors import InputError
from derain.export.methods import load_method, named_method
from derain.files.reading import is_file
from derain.filters.parameters import CANDIDATES
from derain.views.candidates import Bound, Candidates

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


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("dror", {"neighbours": 3}),
        (
            "dsor",
            {CANDIDATES: Candidates((Bound("range", most=30.0), Bound("z", least=-1.5)), 0.5)},
        ),
        (str(KEPT / "outdet.onnx"), {"threshold": 0.25}),
    ],
)
def test_what_a_method_says_of_itself_makes_the_same_again(
    tmp_path: Path, name: str, parameters: dict[str, Any]
) -> None:
    told = load_method(name, parameters, 1).as_dict()
    (tmp_path / "same.yaml").write_text(yaml.safe_dump(json.loads(json.dumps(told))))
    same_name, same_parameters = named_method(str(tmp_path / "same.yaml"))
    assert same_name == name
    assert parameters.items() <= same_parameters.items()
    assert load_method(same_name, same_parameters, 1).as_dict() == told


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
    out = tmp_path / ("out.ckpt" if command == "import-weights" else "out.onnx")
    outcome = run_derain(command, *options[command], "--out", out)
    assert (outcome.code, outcome.out) == (2, "")
    (line,) = outcome.err.splitlines()
    assert line.startswith(f"derain: {closed}/a.")
    assert "cannot be read (Permission denied)" in line
    assert not (tmp_path / "out.onnx").exists()
