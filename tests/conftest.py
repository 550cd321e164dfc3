"""Fixtures shared by all tests."""

import gc
import os
from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

# The tests run in as many processes as there are cores, and their networks are small: threads that
# wait for each other only cost time. Read when numpy and torch load; processes of tests inherit it.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import pytest
from filelock import FileLock
from hypothesis import settings

from derain.cli.main import main
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.scan import Scan

if TYPE_CHECKING:
    from types import ModuleType

    from matplotlib.figure import Figure
    from torch import nn

    from derain.models.base import DerainingModule
    from derain.models.lisnownet import LiSnowNet
    from derain.models.outdet import OutDet
    from derain.models.salsanext import SalsaNextModule
    from derain.views.candidates import Candidates

REPOSITORY = Path(__file__).resolve().parent.parent

# No test asserts a time, of which a busy machine takes any. Every run draws other examples, so that
# few a run are many over all runs.
settings.register_profile("untimed", deadline=None, max_examples=50)
settings.load_profile("untimed")


def pytest_collection() -> None:
    """Collects no garbage while modules are loaded, which make none."""
    gc.disable()


def pytest_collection_finish() -> None:
    """Keeps what is loaded out of garbage collection, of which every run would go through it."""
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder with real scans and oracles; tests that need it skip where it is absent."""
    folder = Path(os.environ.get("DERAIN_SHARED", REPOSITORY.parent / "shared"))
    if not (folder / "data").is_dir():
        pytest.skip(f"no real scans at {folder}; set DERAIN_SHARED to the folder that has them")
    return folder


@pytest.fixture(scope="session")
def open3d() -> "ModuleType":
    """Open3D; tests that need it skip where it cannot be imported."""
    from derain.system.open3d_import import import_open3d

    try:
        return import_open3d()
    except InputError as error:
        pytest.skip(str(error))


@pytest.fixture
def here(tmp_path, monkeypatch) -> Path:
    """The test's own folder, in which it runs."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def full_disk() -> Iterator[Callable[[], None]]:
    """From its call on, no file may grow beyond 50,000 bytes: a log does not, a result does."""
    resource = pytest.importorskip("resource", reason="the system has no limits on files")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, before[1]))
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture(scope="session")
def small_world(open3d, tmp_path_factory) -> Path:
    """A world that is quick to simulate: a bare street in the snow, seen by few beams."""
    path = tmp_path_factory.mktemp("world") / "small.yaml"
    path.write_text(
        "places: {street: 1}\nhorizon: 0\ncarrier: 0\n"
        "sensors: {kinds: {front: 1}, front_rows: [32], front_step: [0.5, 1.0]}\n"
        "precipitation: {snow: {weight: 1, crowding: [0.1, 0.3]}}\n"
    )
    return path


@dataclass(frozen=True)
class Outcome:
    """What a command of derain came to: its exit code and what it printed."""

    code: int
    out: str
    err: str

    @property
    def messages(self) -> list[str]:
        """Lines on stderr but for those on how much is called rain: random networks take half."""
        return [line for line in self.err.splitlines() if "called rain" not in line]


RunDerain = Callable[..., Outcome]


@pytest.fixture
def run_derain(capsys, monkeypatch) -> RunDerain:
    """Runs a command of derain in this process.

    `derain run` leaves no scan whole: of made-up scans, which are sparse, filters and random
    networks call most rain.
    """
    monkeypatch.setattr("derain.cli.run.MOST_RAIN", 1.0)

    def run(*arguments: str | Path) -> Outcome:
        capsys.readouterr()
        try:
            code = main([str(argument) for argument in arguments])
        except SystemExit as leaving:  # argparse's way out
            code = leaving.code if isinstance(leaving.code, int) else 0
        return Outcome(code, *capsys.readouterr())

    return run


@pytest.fixture
def saved_figures(monkeypatch) -> "list[Figure]":
    """Every figure that was written to a file, in order."""
    from matplotlib.figure import Figure

    figures: list[Figure] = []
    savefig = Figure.savefig

    def noted(figure: Figure, *arguments: Any, **options: Any) -> None:
        savefig(figure, *arguments, **options)
        figures.append(figure)

    monkeypatch.setattr(Figure, "savefig", noted)
    return figures


@pytest.fixture(scope="session")
def made_once(tmp_path_factory) -> Callable[..., Path]:
    """Makes a file by name once for all processes that share out the tests."""
    shared_out = "PYTEST_XDIST_WORKER" in os.environ
    own = tmp_path_factory.getbasetemp()
    folder = (own.parent if shared_out else own) / "made_once"
    folder.mkdir(exist_ok=True)

    def make(name: str, write: Callable[[Path], object]) -> Path:
        path = folder / name
        with FileLock(f"{path}.lock"):
            if not path.exists():
                write(path)
        return path

    return make


@pytest.fixture(scope="session")
def random_outdet() -> "OutDet":
    """3D-OutDet with random weights and the statistics of WADS; it calls half of a scene rain."""
    import torch

    from derain.cards.card import load_card
    from derain.models.outdet import OutDet

    with torch.random.fork_rng(), torch.no_grad():
        torch.manual_seed(0)
        model = OutDet().eval()
        model.adopt(model.spec_for(load_card("wads")))
        for norm in (model.network.norm1, model.network.norm2):
            norm.running_mean.normal_(0, 0.3)
            norm.running_var.uniform_(0.5, 1.5)
            norm.weight.uniform_(0.5, 1.5)
            norm.bias.normal_(0, 0.3)
        view = model.spec.make_view()(Scan.of(scene()))
        logits = model(**{name: torch.from_numpy(a) for name, a in view.inputs().items()})
        # Between the two middle points, so that none lies on the threshold.
        model.network.head.bias[0] += (logits[:, 1] - logits[:, 0]).quantile(0.5)
    return model


@pytest.fixture(scope="session")
def checkpoint(random_outdet, made_once) -> Path:
    """A checkpoint of that network."""
    from derain.models.checkpoint import save_model

    return made_once("outdet.ckpt", partial(save_model, random_outdet))


@pytest.fixture(scope="session")
def judging(random_outdet, made_once) -> "Callable[[str, Candidates | None, int], Path]":
    """Exports the same network under a name, with candidates and in so many blocks."""
    from derain.export.onnx_file import export

    def exported(name: str, candidates: "Candidates | None", blocks: int) -> Path:
        model = deepcopy(random_outdet)
        model.adopt(replace(model.spec, candidates=candidates))
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("derain.models.outdet.network.BLOCKS", blocks)
            return made_once(name, partial(export, model))

    return exported


@pytest.fixture(scope="session")
def onnx_model(judging) -> Path:
    """The same network, exported; in two blocks, which are traced several times as quickly."""
    return judging("outdet.onnx", None, 2)


@pytest.fixture(scope="session")
def candidates() -> "Candidates":
    """Bounds that leave out some points of every kind."""
    from derain.views.candidates import Bound, Candidates

    return Candidates((Bound("range", least=2.0, most=25.0), Bound("intensity", most=40.0)))


@pytest.fixture(scope="session")
def judging_candidates(judging, candidates) -> Path:
    """The same network, exported with those candidates."""
    return judging("candidates.onnx", candidates, 2)


@pytest.fixture(scope="session")
def small_grid() -> dict[str, Any]:
    """A grid of few pixels, its sides no multiples of 16: most points of a scene lose theirs."""
    return {"rows": 18, "columns": 60, "inclination": [-30.0, 20.0]}


@pytest.fixture(scope="session")
def random_salsanext(small_grid) -> "SalsaNextModule":
    """A narrow SalsaNext of random weights; it calls half of a scene rain."""
    from derain.models.salsanext import SalsaNext

    return _random_segmenter(SalsaNext, small_grid)


@pytest.fixture(scope="session")
def random_salsanext_lite(small_grid) -> "SalsaNextModule":
    """The same of the variant that folds."""
    from derain.models.salsanext_lite import SalsaNextLite

    return _random_segmenter(SalsaNextLite, small_grid)


def _random_segmenter(
    model_class: "type[SalsaNextModule]", grid: dict[str, Any]
) -> "SalsaNextModule":
    import torch

    from derain.cards.card import load_card

    with torch.random.fork_rng(), torch.no_grad():
        torch.manual_seed(0)
        model = model_class(grid=grid, width=4).eval()
        model.adopt(model.spec_for(load_card("wads")))
        _randomise(model.network, gain=1.4)
        view = model.spec.make_view()(Scan.of(scene()))
        logits = model(**{name: torch.from_numpy(a) for name, a in view.inputs().items()})
        margin = view.back((logits[:, 1] - logits[:, 0]).numpy())
        middle = np.median(margin)
        # Between two pixels, so that none lies on the threshold.
        model.network.head.bias[0] += float(middle + margin[margin > middle].min()) / 2
    return model


@pytest.fixture(scope="session")
def random_lisnownet(small_grid) -> "LiSnowNet":
    """A narrow LiSnowNet of random weights, whose rule knows no limits; it finds rain."""
    import torch

    from derain.cards.card import load_card
    from derain.models.lisnownet import LiSnowNet

    unlimited = {"residual": 0.008, "ground": -10.0, "intensity": 1.0}
    with torch.random.fork_rng(), torch.no_grad():
        torch.manual_seed(0)
        model = LiSnowNet(grid=small_grid, width=4, rule=unlimited).eval()
        model.adopt(model.spec_for(load_card("wads")))
        _randomise(model.network, gain=0.6)
    return model


def _randomise(network: "nn.Module", gain: float) -> None:
    """Draws weights and BatchNorm statistics as a training might leave them."""
    for name, tensor in network.state_dict().items():
        if tensor.ndim > 1:
            tensor.normal_(0, gain * tensor[0].numel() ** -0.5)
        elif tensor.is_floating_point():
            centre = 1.0 if ".norm." in name and name.endswith(("running_var", "weight")) else 0.0
            tensor.uniform_(centre - 0.2, centre + 0.2)


@pytest.fixture(scope="session", params=["salsanext", "salsanext_lite", "lisnownet"])
def image_model(request) -> "DerainingModule":
    """Each of the networks on range images."""
    return request.getfixturevalue(f"random_{request.param}")


@pytest.fixture(scope="session")
def image_onnx(image_model, made_once) -> Path:
    """The same network, exported."""
    from derain.export.onnx_file import export

    return made_once(f"{image_model.NAME}.onnx", partial(export, image_model))


@pytest.fixture(scope="session")
def salsanext_onnx(random_salsanext, made_once) -> Path:
    """One of them, for what does not depend on the network."""
    from derain.export.onnx_file import export

    return made_once("salsanext.onnx", partial(export, random_salsanext))


@pytest.fixture
def one_block(monkeypatch) -> None:
    """Exports 3D-OutDet in one block: the same network, traced several times as quickly."""
    monkeypatch.setattr("derain.models.outdet.network.BLOCKS", 1)


@pytest.fixture
def short_proof(monkeypatch) -> None:
    """Proves exported networks on one small scene; the whole proof has tests of its own."""
    from derain.export import onnx_file

    monkeypatch.setattr(onnx_file, "hard_cases", lambda: [("scene", Scan.of(scene(100)))])


@pytest.fixture
def two_sizes(monkeypatch) -> None:
    """Halves images once in LiSnowNet: a network of two stages, traced in a third of the time."""
    monkeypatch.setattr("derain.models.lisnownet.network.HALVINGS", 1)


@pytest.fixture
def changed_model(onnx_model, tmp_path) -> Callable[[dict[str, Any]], Path]:
    """Makes a copy of the exported network with other metadata."""
    import onnx

    from derain.export.onnx_file import with_metadata

    def change(metadata: dict[str, Any]) -> Path:
        proto = onnx.load(onnx_model)
        path = tmp_path / "model" / "changed.onnx"
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(with_metadata(proto, metadata))
        return path

    return change


@pytest.fixture
def in_this_process(monkeypatch) -> None:
    """Times methods in this process; that each has its own is tested by itself."""
    from derain.export.bench import bench
    from derain.export.bench.cost import measure_in_process

    monkeypatch.setattr(bench, "measure_cost", measure_in_process)


@pytest.fixture
def stand_in_for_derain(tmp_path, monkeypatch) -> "Callable[[ModuleType, str], Path]":
    """Puts a script in the place of derain, and returns where it records its calls."""

    def put(caller: "ModuleType", script: str) -> Path:
        stand_in, calls = tmp_path / "derain", tmp_path / "calls.txt"
        stand_in.write_text(f'#!/bin/sh\necho "$@" >> "{calls}"\n{script}')
        stand_in.chmod(0o755)
        monkeypatch.setattr(caller, "DERAIN", stand_in)
        return calls

    return put
