"""The runtime gives PyTorch's answers, for any array and in its order, scan by scan or pushed.

``kept/`` holds a 3D-OutDet of three neighbours, of random weights drawn with seed 0. The checkpoint
was written by `save_model`, the model by ``derain export outdet.ckpt --out outdet.onnx`` of
derain 0.1.0, before a Spec could lack a field and before a file had a checksum. ``probability.npy``
is what that model answered for ``scene(300)``. ``version1.onnx`` has the network of version 1 of
the default model, small, trained on a few scenes and exported by derain 0.2.0; ``version1.npy`` is
what it answered. None of the five is ever to be written again.
"""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.export.runtime import Derainer
from derain.filters import DROR
from derain.models.base import DerainingModule
from derain.models.checkpoint import load_model
from derain.scan import Float32s, Scan
from derain.sources.frame import MemoryFrame
from derain.system.stopwatch import Stopwatch
from derain.views.probability import probability_of_rain

KEPT = Path(__file__).parent / "kept"
POINTS = 200


@pytest.fixture(scope="module")
def derainer(onnx_model) -> Derainer:
    return Derainer(onnx_model, threads=1)


def from_pytorch(model: DerainingModule, scan: Scan) -> Float32s:
    view = model.spec.make_view()(scan)
    inputs = {title: torch.from_numpy(array) for title, array in view.inputs().items()}
    with torch.inference_mode():
        return view.back(probability_of_rain(model(**inputs).numpy()))


def test_the_answers_are_those_of_pytorch(derainer, random_outdet) -> None:
    assert 0.4 < derainer(scene()).mean() < 0.6  # what the tests compare is worth comparing
    for name, scan in hard_cases(largest=3000):
        probability = derainer.probability(scan)
        expected = from_pytorch(random_outdet, scan)
        np.testing.assert_allclose(probability, expected, atol=2e-5, err_msg=name)
        np.testing.assert_array_equal(derainer(scan), probability > 0.5, err_msg=name)


def test_files_of_an_early_derain_answer_as_they_did() -> None:
    kept = np.load(KEPT / "probability.npy")
    assert 0.2 < (kept > 0.5).mean() < 0.8
    early, model = Derainer(KEPT / "outdet.onnx", threads=1), load_model(KEPT / "outdet.ckpt")
    np.testing.assert_allclose(early.probability(scene(300)), kept, rtol=0, atol=1e-6)
    np.testing.assert_allclose(from_pytorch(model, Scan.of(scene(300))), kept, rtol=0, atol=1e-6)
    assert model.spec == early.spec
    assert (early.spec.data, early.spec.rain) == ("WADS", (110,))
    assert len(early.metadata["proof"]["cases"]) == 48


def test_files_of_version_1_of_the_default_model_answer_as_they_did() -> None:
    kept = np.load(KEPT / "version1.npy")
    assert 0.02 < (kept > 0.5).mean() < 0.1
    early = Derainer(KEPT / "version1.onnx", threads=1)
    np.testing.assert_allclose(early.probability(scene(300)), kept, rtol=0, atol=1e-6)
    assert (early.spec.network, early.spec.channels) == ("relative_outdet", ("x", "y", "z"))


@pytest.mark.parametrize(
    "convert",
    [
        np.asfortranarray,
        lambda points: np.repeat(points, 2, axis=0)[::2],
        lambda points: points.astype(">f4"),
    ],
    ids=["Fortran order", "strided", "big-endian"],
)
def test_points_lie_in_memory_in_any_way(derainer, convert) -> None:
    points = scene(500)
    np.testing.assert_array_equal(
        derainer.probability(convert(points)), derainer.probability(points)
    )
    np.testing.assert_array_equal(points, scene(500))  # which are left as they were


def test_points_without_intensity_get_the_mean_of_the_training_data(derainer) -> None:
    points = scene(500)
    points[:, 3] = derainer.spec.mean[3]
    expected = derainer.probability(points[:, :3])
    np.testing.assert_array_equal(derainer.probability(points), expected)
    points[:, 3] = 7  # everywhere, so that it was not measured
    np.testing.assert_array_equal(derainer.probability(points), expected)


def test_rows_that_cannot_be_judged_are_not_rain_and_change_no_other(derainer) -> None:
    points = scene(500)
    rows = [
        *([np.nan, 1, 1, 1], [1, np.inf, 1, 1], [1, 1, -np.inf, 1], [1, 1, 1, np.nan]),
        *([0, 0, 0, 50], [-1, -1, -1, -1], [1e30, 1, 1, 1]),
    ]
    places = [0, 100, 200, 300, 400, 500, 500]
    probability = derainer.probability(np.insert(points, places, np.float32(rows), axis=0))
    inserted = np.array(places) + np.arange(len(places))
    np.testing.assert_array_equal(probability[inserted], 0)
    np.testing.assert_array_equal(np.delete(probability, inserted), derainer.probability(points))


def test_rays_without_a_return_that_moved_with_their_frame_are_left_alone(derainer) -> None:
    points = scene(POINTS)
    no_returns = np.tile(np.float32([[3, 0, 1, 0]]), (60, 1))
    judgement = derainer.judge(np.concatenate([points, no_returns]))
    np.testing.assert_array_equal(judgement.judged, np.arange(POINTS + 60) < POINTS)
    np.testing.assert_array_equal(judgement.rain[:POINTS], derainer(points))
    assert "points outside the grid" not in {one.kind for one in derainer.issues(judgement)}


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_neither_order_nor_copies_nor_threads_matter(derainer, onnx_model, seed) -> None:
    points, generator = scene(700), np.random.default_rng(seed)
    answer = derainer.probability(points)
    rows = generator.permutation(np.concatenate([np.arange(700), generator.integers(0, 700, 99)]))
    np.testing.assert_allclose(derainer.probability(points[rows]), answer[rows], atol=1e-6)
    of_two = Derainer(onnx_model, threads=2)
    assert (derainer.threads, of_two.threads) == (1, 2)
    np.testing.assert_allclose(of_two.probability(points), answer, atol=1e-6)


def test_the_threshold_is_that_of_the_file(derainer, changed_model) -> None:
    stricter = Derainer(changed_model({"spec": {**derainer.metadata["spec"], "threshold": 0.75}}))
    np.testing.assert_array_equal(stricter(scene()), stricter.probability(scene()) > 0.75)
    assert 0 < stricter(scene()).sum() < derainer(scene()).sum()


@pytest.mark.parametrize(
    ("given_", "reason"),
    [
        ("none.onnx", r"none\.onnx: there is no such file"),
        (".", "cannot be read .Is a directory"),
        ("dror", "derain.FilterDerainer"),
        (DROR(), "derain.FilterDerainer"),
        (np.zeros((5, 4)), "path of an ONNX file"),
    ],
    ids=["missing", "folder", "filter", "object", "array"],
)
def test_what_is_no_model_is_refused(given_, reason) -> None:
    with pytest.raises(InputError, match=reason):
        Derainer(given_)


def test_a_derainer_can_be_pickled(onnx_model) -> None:
    derainer = Derainer(onnx_model, threads=2)
    derainer.spec, derainer.warns = replace(derainer.spec, threshold=0.9), False
    again = pickle.loads(pickle.dumps(derainer))
    assert (again.name, again.threads, again.runtime) == (str(onnx_model), 2, derainer.runtime)
    assert (again.spec, again.warns) == (derainer.spec, False)
    np.testing.assert_array_equal(again(scene()), derainer(scene()))
    assert pickle.loads(pickle.dumps(Derainer())).name == "default"


def test_a_frame_is_answered_at_once_as_if_it_were_judged_alone(derainer) -> None:
    scan, stopwatch = Scan.of(scene(POINTS)), Stopwatch()
    frame = MemoryFrame(key="0", scan=scan)
    judgement = derainer.push(frame, stopwatch)
    assert judgement.frame is frame
    assert list(stopwatch.milliseconds) == ["read", "view", "network", "back"]
    assert (derainer.waiting, derainer.starts_new_recording(frame)) == (0, False)
    for points in (scan, scene(POINTS)):
        of_points = derainer.push(points)
        assert of_points.frame is None
        np.testing.assert_array_equal(of_points.probability, judgement.probability)
    assert list(derainer.flush()) == []
