"""A method is found by its name or its file of parameters; what is wrong with it is one line."""

import json
from pathlib import Path

import pytest
import yaml

from derain.errors import InputError
from derain.export.methods import (
    load_method,
    load_method_of_one_scan,
    named_method,
    read_parameters,
)
from derain.export.runtimes.session import Runtime
from derain.filters.derainer import CANDIDATES
from derain.recordings.persistence import Persistence, PersistenceDerainer
from derain.views.candidates import Bound, Candidates

KEPT = Path(__file__).parent / "kept"
BOUNDS = Candidates((Bound("range", most=30.0), Bound("z", least=-1.5)), 0.5)


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("dror", {"neighbours": 3}),
        ("dsor", {CANDIDATES: BOUNDS}),
        (str(KEPT / "outdet.onnx"), {"threshold": 0.25}),
    ],
)
def test_a_method_is_made_again_from_what_it_writes(tmp_path, name, parameters) -> None:
    written = load_method(name, parameters, 1).as_dict()
    (tmp_path / "same.yaml").write_text(yaml.safe_dump(json.loads(json.dumps(written))))
    same_name, same_parameters = named_method(str(tmp_path / "same.yaml"))
    assert same_name == name
    assert parameters.items() <= same_parameters.items()
    assert load_method(same_name, same_parameters, 1).as_dict() == written


@pytest.mark.parametrize(
    ("name", "parameters", "reason"),
    [
        (str(KEPT / "outdet.ckpt"), {}, f"--out {KEPT}/outdet.onnx`"),
        ("none.ckpt", {}, "none.ckpt: no such method or file"),
        ("dro", {}, "dro: no such method or file. Did you mean dror? Give a model"),
        (str(KEPT / "outdet.onnx"), {"neighbours": 3}, "it has no parameter neighbours"),
        (str(KEPT / "outdet.onnx"), {"threshold": 1.5}, "threshold is 1.5"),
        (str(KEPT / "outdet.onnx"), {"threshold": "high"}, "threshold is high"),
    ],
)
def test_a_method_that_cannot_be_made_is_refused(name, parameters, reason) -> None:
    with pytest.raises(InputError) as refusal:
        load_method(name, parameters)
    assert reason in str(refusal.value)


@pytest.mark.parametrize(
    "content",
    [
        "",
        "neighbours: 3",
        "method: 5",
        "method: foo",
        "method: dror\nneighbours: 1",
        "method: persistence\nreach: 1",
        "method: dsor\nneighbours: [5]",
        "method: dsor\nrange_multiplier: .inf",
        "method: dsor\nrange_multiplier: null",
        f"method: dsor\nneighbours: 0x{'f' * 5000}",
        "method: w2.onnx\nthreshold: .9",
    ],
)
def test_a_file_that_holds_no_parameters_is_refused(tmp_path, content) -> None:
    path = tmp_path / "best.yaml"
    path.write_text("# 100 trials\nmethod: dsor\nneighbours: 7\nrange_multiplier: 0.0812\n")
    assert read_parameters(path) == ("dsor", {"neighbours": 7, "range_multiplier": 0.0812})
    path.write_text(content)
    with pytest.raises(InputError, match=r"best\.yaml: ") as refusal:
        read_parameters(path)
    assert len(str(refusal.value)) < len(str(path)) + 300


def test_persistence_is_made_of_its_parameters_and_sees_several_scans() -> None:
    method = load_method("persistence", {"before": 2, "sure": 5.0}, threads=3)
    assert isinstance(method, PersistenceDerainer)
    assert (method.persistence, method.threads) == (Persistence(before=2, sure=5.0), 3)
    assert method.as_dict() == {"method": "persistence", "before": 2, "after": 1, "sure": 5.0}
    with pytest.raises(InputError, match=r"persistence: it has no parameter reach, way\. It has"):
        load_method("persistence", {"way": 1, "reach": 2, "before": 1})
    with pytest.raises(InputError, match="a method, which has no network that openvino"):
        load_method("persistence", {}, runtime=Runtime("openvino"))
    with pytest.raises(InputError, match="persistence: sees the scans around the one that it"):
        load_method_of_one_scan("persistence", {})
    with pytest.raises(InputError, match=r"one of .*dror.*, persistence"):
        load_method("nobody", {})
