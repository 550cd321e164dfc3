"""Models that examples are tried with."""

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from derain.views.candidates import Bound, Candidates

if TYPE_CHECKING:
    from derain.models.outdet import OutDet


@pytest.fixture(scope="session")
def candidates() -> Candidates:
    """Bounds that leave out some points of every kind."""
    return Candidates((Bound("range", least=2.0, most=9.0), Bound("intensity", most=99.0)))


@pytest.fixture(scope="session")
def judging_candidates(
    random_outdet: "OutDet", candidates: Candidates, made_once: Callable[..., Path]
) -> Path:
    """3D-OutDet of random weights, exported with those candidates."""
    from derain.export.onnx_file import export

    model = deepcopy(random_outdet)
    model.adopt(replace(model.spec, candidates=candidates))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("derain.models.outdet.deployed.BLOCKS", 1)  # traced several times as quickly
        return made_once("examples_candidates.onnx", partial(export, model))
