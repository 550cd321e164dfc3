"""Methods of recordings are found by their names, and made from parameters."""

import pytest
from window_method import Between, Dimmer

from derain.errors import InputError
from derain.export.methods import load_method, load_method_of_one_scan
from derain.export.runtimes.session import Runtime
from derain.recordings.recording_method import METHODS


@pytest.fixture
def between(monkeypatch) -> None:
    """Enters the method of these tests."""
    monkeypatch.setattr(METHODS, "_members", {**METHODS, "between": Between})


@pytest.mark.usefixtures("between")
def test_a_method_is_loaded_by_its_name_with_its_parameters() -> None:
    method = load_method("between", {"rain_below": 7.0}, threads=3)
    assert isinstance(method, Between)
    assert (method.dimmer, method.threads) == (Dimmer(rain_below=7.0), 3)
    assert method.as_dict() == {"method": "between", "rain_below": 7.0, "sure_within": 30.0}


@pytest.mark.usefixtures("between")
def test_what_it_cannot_do_is_one_error() -> None:
    with pytest.raises(InputError, match=r"between: it has no parameter reach, way\. It has rain"):
        load_method("between", {"way": 1, "reach": 2, "rain_below": 3.0})
    with pytest.raises(InputError, match="a method, which has no network that openvino"):
        load_method("between", {}, runtime=Runtime("openvino"))
    with pytest.raises(InputError, match="between: sees the scans around the one that it judges"):
        load_method_of_one_scan("between", {})
    with pytest.raises(InputError, match=r"one of .*dror.*, between"):
        load_method("nobody", {})
