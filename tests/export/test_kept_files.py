"""Files that an early derain wrote are read for good, and say the same.

``kept/`` holds a 3D-OutDet of three neighbours, of random weights drawn with seed 0. The checkpoint
was written by `save_model`, the model by ``derain export outdet.ckpt --out outdet.onnx`` of
derain 0.1.0, before a Spec could lack a field and before a file had a checksum. ``probability.npy``
is what that model said of ``scene(300)``. None of the three is ever to be written again.
"""

from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer
from derain.models.checkpoint import load_model
from derain.scan import Scan
from derain.views.probability import probability_of_rain

KEPT = Path(__file__).parent / "kept"


@pytest.fixture(scope="module")
def probability() -> NDArray[np.float32]:
    """What the model said when it was exported, neither all rain nor none."""
    kept = np.load(KEPT / "probability.npy")
    assert 0.2 < (kept > 0.5).mean() < 0.8
    return kept


def test_a_model_of_an_early_derain_says_what_it_said(probability: NDArray[np.float32]) -> None:
    derainer = Derainer(KEPT / "outdet.onnx", threads=1)
    np.testing.assert_allclose(derainer.probability(scene(300)), probability, rtol=0, atol=1e-6)
    assert (derainer.spec.data, derainer.spec.rain) == ("WADS", (110,))
    assert len(derainer.metadata["proof"]["cases"]) == 48


def test_a_checkpoint_of_an_early_derain_says_what_it_said(
    probability: NDArray[np.float32],
) -> None:
    model = load_model(KEPT / "outdet.ckpt")
    assert model.spec == Derainer(KEPT / "outdet.onnx", threads=1).spec
    view = model.spec.make_view()(Scan.of(scene(300)))
    with torch.inference_mode():
        logits = model(**{name: torch.from_numpy(array) for name, array in view.inputs().items()})
    said = view.back(probability_of_rain(logits.numpy()))
    np.testing.assert_allclose(said, probability, rtol=0, atol=1e-6)
