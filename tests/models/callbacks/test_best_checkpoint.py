"""A run that goes on in another folder keeps what was best as one that never stopped."""

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import lightning
import pytest
import torch
from contents import contents
from lightning.pytorch.callbacks import ModelCheckpoint
from torch import Tensor

from derain.models.callbacks.best_checkpoint import BestCheckpoint
from derain.models.callbacks.resumption import Resumption

Fit = Callable[..., ModelCheckpoint]


# As derain's command line has it: a run in the same folder writes under the same names.
NAMED = {"enable_version_counter": False}


class Counter(lightning.LightningModule):
    """Its weight is the number of epochs it was trained, and its scores are given."""

    def __init__(self, scores: tuple[float, ...]) -> None:
        super().__init__()
        self.scores = scores
        self.weight = torch.nn.Parameter(torch.zeros(1))

    def training_step(self, batch: Tensor) -> Tensor:
        return -(self.weight * batch).sum()

    def on_train_epoch_end(self) -> None:
        self.log("score", self.scores[self.current_epoch])

    def configure_optimizers(self) -> torch.optim.Optimizer:
        return torch.optim.SGD(self.parameters(), lr=1)


@pytest.fixture
def fit(make_trainer, tmp_path) -> Fit:
    """Trains up to an epoch in a folder, from the last checkpoint of another one if it is named."""

    def run(
        folder: str,
        epochs: int,
        scores: tuple[float, ...],
        earlier: str = "",
        kind: type[ModelCheckpoint] = BestCheckpoint,
        **options: Any,
    ) -> ModelCheckpoint:
        best = kind(tmp_path / folder, monitor="score", **{**NAMED, "filename": "best", **options})
        last = ModelCheckpoint(tmp_path / folder, **NAMED, filename="last")
        trainer = make_trainer(
            epochs,
            callbacks=[best, last, Resumption()],
            enable_checkpointing=True,
            log_every_n_steps=1,
        )
        data = torch.utils.data.DataLoader(torch.ones(1))
        path = tmp_path / earlier / "last.ckpt" if earlier else None
        trainer.fit(Counter(scores), data, ckpt_path=path)
        return best

    return run


def weights(folder: Path) -> dict[str, float]:
    """Of every checkpoint in a folder but the last."""
    return {
        path.name: torch.load(path, weights_only=True)["state_dict"]["weight"].item()
        for path in folder.glob("*.ckpt")
        if path.name != "last.ckpt"
    }


@pytest.mark.parametrize(
    ("mode", "writer"),
    [
        ("max", BestCheckpoint),
        ("max", ModelCheckpoint),  # what derain wrote its checkpoints with at first
        ("min", BestCheckpoint),
    ],
)
@pytest.mark.parametrize("scores", [(3.0, 1.0, 2.0), (2.0, 3.0, 1.0)])
def test_the_best_epoch_is_that_of_an_unbroken_run(fit, tmp_path, scores, mode, writer) -> None:
    options = {"mode": mode, "filename": "{epoch}"}
    unbroken = fit("unbroken", 3, scores, **options)
    fit("first", 1, scores, kind=writer, **options)
    before = contents(tmp_path / "first")
    resumed = fit("second", 3, scores, earlier="first", **options)
    assert weights(tmp_path / "second") == weights(tmp_path / "unbroken")
    assert contents(tmp_path / "first") == before
    assert resumed.best_model_score == unbroken.best_model_score
    assert resumed.kth_value == unbroken.kth_value
    for path in ("best_model_path", "kth_best_model_path"):
        assert getattr(resumed, path) == getattr(unbroken, path).replace("unbroken", "second")


@pytest.mark.parametrize("folder", ["first", "second"])
def test_of_several_best_epochs_the_first_is_taken_over_and_none_is_lost(
    fit, tmp_path, folder
) -> None:
    scores, options = (3.0, 4.0, 1.0), {"mode": "max", "save_top_k": 2, "filename": "{epoch}"}
    fit("first", 2, scores, **options)
    fit(folder, 3, scores, earlier="first", **options)
    assert weights(tmp_path / folder).items() >= {"epoch=1.ckpt": 2, "epoch=2.ckpt": 3}.items()
    assert weights(tmp_path / "first").items() >= {"epoch=0.ckpt": 1, "epoch=1.ckpt": 2}.items()


@pytest.mark.parametrize(("kept", "epochs"), [(2, {0, 2}), (-1, {0, 1, 2})])
def test_several_best_epochs_have_a_name_each(fit, tmp_path, kept, epochs) -> None:
    best = fit("first", 3, (4.0, 1.0, 3.0), mode="max", save_top_k=kept)
    expected = {f"best-epoch={epoch}.ckpt": epoch + 1 for epoch in epochs}
    assert weights(tmp_path / "first") == expected
    assert Path(best.best_model_path).name == "best-epoch=0.ckpt"


@pytest.mark.parametrize(
    ("named", "filename"),
    [
        *(("../precious.ckpt", "best"), ("notes.txt", "best"), ("other.ckpt", "best")),
        *(("..", "best"), ("../../precious.ckpt", "best"), ("../precious.ckpt", "{epoch}")),
    ],
)
@pytest.mark.parametrize("folder", ["runs/first", "runs/second"])
def test_no_file_is_lost_that_a_checkpoint_names(fit, tmp_path, folder, named, filename) -> None:
    scores = (1.0, 2.0, 3.0)
    run = tmp_path / "runs/first"
    fit("runs/first", 1, scores, mode="max", filename=filename)
    precious = [tmp_path / "precious.ckpt", tmp_path / "runs/precious.ckpt"]
    precious += [run / "notes.txt", run / "other.ckpt"]
    for file in precious:
        file.write_text("precious")
    content = torch.load(run / "last.ckpt", weights_only=True)
    path = f"{run}/{named}"
    for state in content["callbacks"].values():
        state.update(best_model_path=path, kth_best_model_path=path, last_model_path=path)
        state.update(best_k_models={path: torch.tensor(0.5)})
    torch.save(content, run / "last.ckpt")
    best = fit(folder, 3, scores, earlier="runs/first", mode="max", filename=filename)
    assert [file.read_text() for file in precious] == ["precious"] * len(precious)
    assert torch.load(best.best_model_path, weights_only=True)["epoch"] == 2


def test_a_run_that_goes_on_in_its_folder_replaces_what_it_has_kept(fit, tmp_path) -> None:
    scores = (2.0, 1.0, 3.0)
    options = {"mode": "max", "filename": "{epoch}"}
    fit("run", 1, scores, **options)
    fit("run", 2, scores, earlier="run", **options)
    assert weights(tmp_path / "run") == {"epoch=0.ckpt": 1}
    fit("run", 3, scores, earlier="run", **options)
    assert weights(tmp_path / "run") == {"epoch=2.ckpt": 3}


def test_a_run_that_was_moved_goes_on_with_its_best(fit, tmp_path) -> None:
    scores = (3.0, 1.0, 2.0)
    fit("first", 1, scores, mode="max")
    (tmp_path / "first").rename(tmp_path / "moved")
    fit("second", 3, scores, earlier="moved", mode="max")
    assert weights(tmp_path / "second") == {"best.ckpt": 1}


def test_a_run_whose_last_checkpoint_was_moved_goes_on_with_the_best_in_its_folder(
    fit, tmp_path
) -> None:
    scores = (3.0, 1.0, 2.0)
    fit("first", 1, scores, mode="max")
    (tmp_path / "moved").mkdir()
    (tmp_path / "first/last.ckpt").rename(tmp_path / "moved/last.ckpt")
    fit("first", 3, scores, earlier="moved", mode="max")
    assert weights(tmp_path / "first") == {"best.ckpt": 1}


def test_a_run_whose_best_is_gone_starts_anew_with_a_warning(fit, tmp_path, capsys) -> None:
    scores = (3.0, 2.0, 1.0)
    gone = Path(fit("first", 1, scores, mode="max").best_model_path)
    gone.unlink()
    resumed = fit("second", 3, scores, earlier="first", mode="max")
    assert weights(tmp_path / "second") == {"best.ckpt": 2}
    assert resumed.best_model_score == 2
    printed = [line for line in capsys.readouterr().err.splitlines() if line.startswith("derain: ")]
    assert len(printed) == 1
    assert printed[0].startswith(f"derain: warning: {gone}: not found")


@pytest.mark.parametrize("first", [True, False])
def test_only_the_first_process_copies(fit, tmp_path, first) -> None:
    state = fit("first", 1, (3.0,), mode="max").state_dict()
    best = BestCheckpoint(tmp_path / "second", filename="best", monitor="score", mode="max")
    best.load_state_dict(state)
    strategy = SimpleNamespace(broadcast=lambda _: True)
    trainer = SimpleNamespace(
        is_global_zero=first,
        ckpt_path=tmp_path / "first/last.ckpt",
        fast_dev_run=False,
        strategy=strategy,
    )
    best.on_train_start(trainer, None)
    assert (tmp_path / "second/best.ckpt").exists() == first
    assert (best.best_model_score, best.kth_value) == (3, 3)
    assert best.best_model_path == str(tmp_path / "second/best.ckpt")


@pytest.mark.parametrize(("epochs", "validations"), [(1, 1), (3, 1), (4, 1), (9, 2)])
def test_a_training_too_short_for_a_validation_ends_with_one(
    make_trainer, tmp_path, epochs, validations
) -> None:
    class Validated(Counter):
        validated = 0

        def validation_step(self, batch: Tensor) -> None:
            self.validated += 1

    model = Validated((1.0,) * epochs)
    trainer = make_trainer(
        epochs,
        callbacks=[BestCheckpoint(tmp_path, monitor="score")],
        enable_checkpointing=True,
        check_val_every_n_epoch=4,
        num_sanity_val_steps=0,
    )
    data = torch.utils.data.DataLoader(torch.ones(1))
    trainer.fit(model, data, data)
    assert model.validated == validations
    assert list(tmp_path.glob("*.ckpt"))
