"""3D-OutDet computes what was published, whatever it is given."""

import numpy as np
import pytest
import torch
from torch import Tensor

from derain.cards.card import load_card
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.learning.batch import Batch, Sample
from derain.models.outdet import PUBLISHED_KEYS, OutDet, OutDetNetwork
from derain.models.published import read_state_dict
from derain.scan import Floats, Ints, Scan
from derain.views.candidates import Bound, Candidates
from derain.views.neighbours import NeighbourView


def published(network: OutDetNetwork) -> dict[str, Tensor]:
    """The network's tensors under the published keys."""
    return {PUBLISHED_KEYS[name]: tensor for name, tensor in network.state_dict().items()}


def as_published(
    state_dict: dict[str, Tensor],
    points: Floats,
    distances: Floats,
    neighbours: Ints,
    training: bool = False,
) -> Floats:
    """The published formula, term by term, without dropout.

    Source: sporsho/3D_OutDet, _out_det.py.
    """
    p = {key: tensor.double().numpy() for key, tensor in state_dict.items()}

    def batch_norm(x: Floats, name: str) -> Floats:
        mean, var = p[f"{name}.running_mean"], p[f"{name}.running_var"]
        if training:
            mean, var = x.mean(axis=0), x.var(axis=0)
        return (x - mean) / np.sqrt(var + 1e-5) * p[f"{name}.weight"] + p[f"{name}.bias"]

    def leaky(x: Floats) -> Floats:
        return np.where(x > 0, x, 0.2 * x)

    d = (p["convs.0.conv1.dw"] * (distances + 1.0))[..., None]
    seen = np.concatenate([points[neighbours], d], axis=-1)
    h = np.einsum("ijk,klj->il", seen, p["convs.0.conv1.weight"]) + p["convs.0.conv1.b"]
    h = leaky(batch_norm(h, "convs.0.bn1"))
    h = np.einsum("ijk,klj->il", h[neighbours], p["convs.0.conv2.weight"])
    h = batch_norm(h, "convs.0.bn2")
    h = leaky(h + points @ p["convs.0.downsample.weight"][..., 0].T)
    return h @ p["fc.weight"].T + p["fc.bias"]


def inputs_of(sample: Sample) -> dict[str, Tensor]:
    return Batch.of([sample]).inputs


@pytest.mark.parametrize("training", [False, True], ids=["evaluation", "training"])
@pytest.mark.parametrize(("seed", "neighbours"), [(0, 9), (1, 9), (2, 4), (3, 1)])
def test_the_network_is_the_published_formula(outdet, sample, seed, neighbours, training) -> None:
    model = outdet(seed, neighbours)
    view = sample(model, scene(400, seed)).view
    network = model.network.double().train(training)
    network.dropout.p = 0.0
    points = np.random.default_rng(seed).normal(size=view.points.shape)
    distances = view.distances.astype(np.float64)
    state_dict = {key: tensor.clone() for key, tensor in published(network).items()}
    expected = as_published(state_dict, points, distances, view.neighbours, training)
    logits = network(
        torch.from_numpy(points), torch.from_numpy(distances), torch.from_numpy(view.neighbours)
    )
    np.testing.assert_allclose(logits.detach(), expected, rtol=1e-9, atol=1e-9)


def test_the_model_normalises_what_the_network_sees(outdet, sample) -> None:
    model = outdet(4)
    view = sample(model, scene(400)).view
    points = (view.points.astype(np.float64) - model.spec.mean) / model.spec.std
    expected = as_published(
        published(model.network), points, view.distances.astype(np.float64), view.neighbours
    )
    logits = model(**{name: torch.from_numpy(array) for name, array in view.inputs().items()})
    np.testing.assert_allclose(logits.detach(), expected, atol=2e-4)


@torch.no_grad()
def test_candidates_are_scored_as_they_are_among_all(outdet, sample) -> None:
    model = outdet(seed=6)
    candidates = Candidates((Bound("range", most=20.0),))
    scans = [Scan.of(scene(size, size)) for size in (300, 5, 200)]
    view = NeighbourView(9, threads=1)
    whole = [Sample(scan, view(scan), None) for scan in scans]
    part = [Sample(scan, view.with_candidates(candidates)(scan), None) for scan in scans]
    among = [candidates.among(each.scan)[each.view.first] for each in whole]
    for network in (model, model.deployed()):
        expected = network(**Batch.of(whole).inputs)[np.concatenate(among)]
        torch.testing.assert_close(network(**Batch.of(part).inputs), expected)


@pytest.mark.parametrize("channels", [(), ("x", "y", "x")], ids=str)
def test_channels_are_named_once_each(channels) -> None:
    with pytest.raises(InputError, match="Name each channel once"):
        OutDet(channels=channels)


def test_a_spec_of_another_network_or_of_other_channels_is_refused(outdet) -> None:
    with pytest.raises(InputError, match="a model of salsanext"):
        OutDet(spec={**outdet().spec.as_dict(), "network": "salsanext"})
    with pytest.raises(InputError, match="Give one of outdet on x, y, z, rcs"):
        OutDet(channels=("x", "y", "z", "rcs"), spec=outdet().spec.as_dict())


@pytest.mark.parametrize("neighbours", [9, 3])
@pytest.mark.parametrize("prefix", ["", "module."])
def test_published_weights_are_taken_over(outdet, sample, prefix, neighbours) -> None:
    own = outdet(5, neighbours)
    weights = {prefix + key: tensor for key, tensor in published(own.network).items()}
    inputs = inputs_of(sample(own, scene(200)))
    copy = OutDetNetwork.from_published(weights).eval()
    assert torch.equal(copy(**inputs), own.network(**inputs))
    model = OutDet.from_published(weights, load_card("wads"))
    assert model.spec.view == {"kind": "neighbours", "neighbours": neighbours}
    means = tuple(load_card("wads").statistics(name)[0] for name in model.spec.channels)
    assert (model.spec.data, model.spec.mean) == ("WADS", means)


@pytest.mark.parametrize(
    "change",
    [
        {"fc.bias": torch.ones(3)},
        {"convs.0.conv1.dw": torch.ones(7)},
        {"convs.0.conv1.dw": torch.tensor(1.0)},
        {"convs.1.conv1.dw": torch.ones(9)},
        {"fc.bias": None},
    ],
    ids=["head", "neighbours", "scalar", "surplus", "missing"],
)
def test_weights_of_another_network_are_refused(outdet, change) -> None:
    weights = {**published(outdet().network), **change}
    weights = {key: tensor for key, tensor in weights.items() if tensor is not None}
    with pytest.raises(InputError, match="3D-OutDet: the state_dict is of another network"):
        OutDetNetwork.from_published(weights)


@pytest.fixture(scope="module")
def on_wads(shared) -> tuple[OutDet, Sample, Tensor]:
    """The published weights, the published scan, and the logits of the one for the other."""
    model = OutDet.from_published(
        read_state_dict(shared / "oracles/outdet_wads.pt"), load_card("wads")
    ).eval()
    points = np.fromfile(shared / "data/wads/sample.bin", np.float32).reshape(-1, 4)
    label = np.fromfile(shared / "data/wads/sample.label", np.uint32) & 0xFFFF
    scan = Scan.of(points).with_label(label.astype(np.int64))
    one = Sample(scan, NeighbourView()(scan), None)
    with torch.no_grad():
        return model, one, model(**inputs_of(one))


def test_published_weights_give_the_published_logits(shared, on_wads) -> None:
    model, one, logits = on_wads
    oracle = np.load(shared / "oracles/outdet_wads.npz")["logits"]
    assert sorted(one.view.first) == list(range(len(oracle)))
    np.testing.assert_allclose(logits.numpy(), oracle[one.view.first], atol=1e-4, rtol=0)
    with torch.no_grad():
        folded = model.deployed()(**inputs_of(one))
    np.testing.assert_allclose(folded.numpy(), oracle[one.view.first], atol=1e-4, rtol=0)


@torch.no_grad()
@pytest.mark.parametrize("neighbours", [9, 4])
@pytest.mark.parametrize("channels", ["x y z intensity", "rcs x y z radar intensity"])
def test_the_folded_network_computes_the_same(outdet, sample, neighbours, channels) -> None:
    inputs = inputs_of(sample(outdet(0, neighbours), scene(500)))
    model = outdet(1, neighbours, tuple(channels.split()))
    columns = torch.randn(len(inputs["points"]), len(model.std))
    inputs["points"] = columns * model.std + model.mean
    logits = model(**inputs)
    assert logits.std() > 0.1
    torch.testing.assert_close(model.deployed()(**inputs), logits, atol=2e-4, rtol=2e-4)
