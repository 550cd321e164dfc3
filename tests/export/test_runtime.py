"""The runtime gives PyTorch's answers, for any array and in its order, without torch."""

import pickle
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.export.runtime import Derainer
from derain.filters import DROR
from derain.models.outdet import OutDet
from derain.scan import Scan

Points = NDArray[np.float32]


@pytest.fixture(scope="module")
def derainer(onnx_model: Path) -> Derainer:
    return Derainer(onnx_model, threads=1)


def test_the_answers_are_those_of_pytorch(derainer: Derainer, random_outdet: OutDet) -> None:
    assert 0.4 < derainer(scene()).mean() < 0.6  # what the tests compare is worth comparing
    for name, scan in hard_cases(largest=3000):
        view = random_outdet.spec.make_view()(scan)
        inputs = {title: torch.from_numpy(array) for title, array in view.inputs().items()}
        with torch.inference_mode():
            expected = random_outdet(**inputs).softmax(dim=1)[:, 1].numpy()
        probability = derainer.probability(scan)
        np.testing.assert_allclose(probability, view.back(expected), atol=2e-5, err_msg=name)
        np.testing.assert_array_equal(derainer(scan), probability > 0.5, err_msg=name)


@pytest.mark.parametrize(
    "convert",
    [
        lambda points: np.column_stack([points, np.arange(len(points), dtype=np.float32)]),
        lambda points: points.astype(np.float64),
        np.asfortranarray,
        lambda points: np.repeat(points, 2, axis=0)[::2],
        lambda points: points.astype(">f4"),
        lambda points: Scan(points[:, :3].copy(), points[:, 3].copy()),
        Scan.of,
    ],
    ids=["5 columns", "float64", "Fortran order", "strided", "big-endian", "Scan", "Scan.of"],
)
def test_points_come_in_any_form(derainer: Derainer, convert: Callable[[Points], Any]) -> None:
    points = scene()
    given_points = convert(points)
    mask = derainer(given_points)
    assert mask.dtype == bool
    np.testing.assert_array_equal(mask, derainer(points))
    probability = derainer.probability(given_points)
    assert probability.dtype == np.float32
    np.testing.assert_array_equal(probability, derainer.probability(points))
    np.testing.assert_array_equal(points, scene())  # which are left as they were


def test_points_without_intensity_get_the_mean_of_the_training_data(derainer: Derainer) -> None:
    points = scene()
    points[:, 3] = derainer.spec.mean[3]
    np.testing.assert_array_equal(derainer.probability(points[:, :3]), derainer.probability(points))


@pytest.mark.parametrize("shape", [(4,), (10, 2), (0,), (2, 5, 4)])
def test_an_array_of_another_shape_is_refused(derainer: Derainer, shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match="Give an array of shape"):
        derainer(np.zeros(shape))


@pytest.mark.parametrize(
    "row",
    [
        [np.nan, 1, 1, 1],
        [1, np.inf, 1, 1],
        [1, 1, -np.inf, 1],
        [1, 1, 1, np.nan],
        [0, 0, 0, 50],
        [-1, -1, -1, -1],
        [1e30, 1, 1, 1],
    ],
    ids=str,
)
def test_a_row_that_cannot_be_judged_is_not_rain_and_changes_no_other(
    derainer: Derainer, row: list[float]
) -> None:
    points = scene(500)
    places = [0, 250, 502]
    mixed = np.insert(points, [0, 249, 500], np.array(row, np.float32), axis=0)
    probability = derainer.probability(mixed)
    np.testing.assert_array_equal(probability[places], 0)
    assert not derainer(mixed)[places].any()
    np.testing.assert_array_equal(np.delete(probability, places), derainer.probability(points))


@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_permuted_points_get_the_permuted_answer(derainer: Derainer, seed: int) -> None:
    points = scene(700)
    order = np.random.default_rng(seed).permutation(len(points))
    answer = derainer.probability(points)
    np.testing.assert_allclose(derainer.probability(points[order]), answer[order], atol=1e-6)


def test_duplicates_get_one_answer_and_change_no_other(derainer: Derainer) -> None:
    points = scene()
    copies = np.random.default_rng(0).integers(0, len(points), 2000)
    probability = derainer.probability(np.concatenate([points, points[copies]]))
    np.testing.assert_array_equal(probability[len(points) :], probability[copies])
    np.testing.assert_array_equal(probability[: len(points)], derainer.probability(points))


def test_the_number_of_threads_does_not_change_the_mask(onnx_model: Path) -> None:
    points = scene(20_000)
    one, two = (Derainer(onnx_model, threads) for threads in (1, 2))
    assert (one.threads, two.threads) == (1, 2)
    np.testing.assert_array_equal(one(points), two(points))
    np.testing.assert_allclose(one.probability(points), two.probability(points), atol=1e-6)


def test_the_threshold_is_that_of_the_file(
    onnx_model: Path, saying: Callable[[dict[str, Any]], Path]
) -> None:
    spec = {**Derainer(onnx_model).metadata["spec"], "threshold": 0.75}
    stricter = Derainer(saying({"spec": spec}))
    np.testing.assert_array_equal(stricter(scene()), stricter.probability(scene()) > 0.75)
    assert 0 < stricter(scene()).sum() < Derainer(onnx_model)(scene()).sum()


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda spec: {"spec": {**spec, "schema": 2}}, "schema 2 is newer than this derain's 1"),
        (lambda spec: {}, "it has no Spec"),
        (lambda spec: {"spec": "none"}, "it has no Spec"),
        (lambda spec: {"spec": {}}, "its Spec: network is missing"),
        (lambda spec: {"spec": {**spec, "classes": {"rain": "rain"}}}, "its Spec: classes.rain: "),
        (lambda spec: {"spec": {**spec, "view": {"kind": "hologram"}}}, "unknown view 'hologram'"),
    ],
)
def test_a_spec_that_cannot_be_used_is_refused(
    derainer: Derainer,
    saying: Callable[[dict[str, Any]], Path],
    change: Callable[[dict[str, Any]], dict[str, Any]],
    reason: str,
) -> None:
    model = saying(change(derainer.metadata["spec"]))
    with pytest.raises(InputError, match=reason):
        Derainer(model)


@pytest.mark.parametrize("kept", [0, 10, 1000, 20_000, None])
def test_a_damaged_file_is_refused_in_one_line(
    onnx_model: Path, tmp_path: Path, kept: int | None
) -> None:
    noise = np.random.default_rng(0).bytes(5000)
    damaged = tmp_path / "damaged.onnx"
    damaged.write_bytes(noise if kept is None else onnx_model.read_bytes()[:kept])
    message = r"damaged\.onnx: (not an ONNX model|it has no Spec)"
    with pytest.raises(InputError, match=message) as error:
        Derainer(damaged)
    assert "\n" not in str(error.value)


def test_a_missing_model_is_reported(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.onnx: there is no such file"):
        Derainer(tmp_path / "none.onnx")
    with pytest.raises(InputError, match="is a folder"):
        Derainer(tmp_path)


@pytest.mark.parametrize(
    ("given_", "hint"),
    [
        ("dror", r"derain\.FilterDerainer\(derain\.DROR\(\)\)"),
        ("persistence", r"derain\.PersistenceDerainer\(\)"),
        (DROR(), r"derain\.FilterDerainer"),
        (np.zeros((5, 4)), "path of an ONNX file"),
    ],
    ids=["filter", "method", "object", "array"],
)
def test_what_is_no_model_is_refused_with_what_to_use_instead(given_: Any, hint: str) -> None:
    with pytest.raises(InputError, match=hint):
        Derainer(given_)


def test_a_derainer_can_be_pickled(onnx_model: Path) -> None:
    derainer = Derainer(onnx_model, threads=2)
    derainer.spec, derainer.warns = replace(derainer.spec, threshold=0.9), False
    again = pickle.loads(pickle.dumps(derainer))
    assert (again.name, again.threads, again.runtime) == (str(onnx_model), 2, derainer.runtime)
    assert (again.spec, again.warns) == (derainer.spec, False)
    np.testing.assert_array_equal(again(scene()), derainer(scene()))
    assert pickle.loads(pickle.dumps(Derainer())).name == "default"
    assert Derainer("default").path == Derainer().path
