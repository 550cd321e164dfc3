"""A wrong option, key or value of Lightning's command line is one line that names the right one."""

import shlex
from pathlib import Path

import pytest

from derain.errors import InputError
from derain.workflows.training_errors import refusals_in_a_line

SIMULATED = "data: {class_path: derain.datamodules.simulated.Simulated, init_args: %s}"
FIT = ("fit", "--config", "outdet_simulated.yaml")


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        (
            "--trainer.max_epoch",
            "3",
            "trainer.max_epoch: no such option. Did you mean trainer.max_",
        ),
        ("--data.campain.scans", "1", "no such option. Did you mean data.campaign.scans?"),
        ("--ckpt", "x", "no such option. Did you mean ckpt_path?"),
        ("--colour_of_the_sky", "x", "no such option. All options: --help-all."),
        ("--model", "OutDett", "model: there is no class OutDett. Did you mean OutDet? "),
        ("--data.class_path", "Foldr", "data: there is no class Foldr. Did you mean Folder? "),
        ("--model.width", "8", "the chosen model has no such option. All options: --help-all."),
        ("--data.train", "[]", "the chosen data has no such option. All options: --help-all."),
        ("--data.campaign.scans", "[3]", "data.campaign.scans: cannot be [3]. Give: int."),
        ("--data.loading.columns", "x,y,z", "cannot be x,y,z. Give: a list, such as [a,b]."),
        ("--model.neighbours", "0", "--model.neighbours: "),
        ("--data.loading.batch_size", "0", "batch_size"),
        ("--seed_everything", "-1", "--seed_everything: "),
        ("--trainer.strategy", "foo", "strategy"),
        ("--panels.scans", "-1", "--panels.scans: "),
        ("--trainer.accumulate_grad_batches", "0", "--trainer.accumulate_grad_batches: "),
        ("--trainer.check_val_every_n_epoch", "0", "--trainer.check_val_every_n_epoch: "),
        ("--scan_check.scans", "-1", "--scan_check.scans: "),
        ("--trainer.max_epochs", "-3", "--trainer: `max_epochs` must be"),
        ("--trainer.precision", "bf16-true", "--trainer.precision: "),
    ],
)
def test_an_option_is_refused_in_a_line(last_line, option, value, message) -> None:
    assert message in last_line(*FIT, f"{option}={value}")
    assert not Path("runs").exists()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (SIMULATED % "{loading: {kept_megabytes: 1}}", "Did you mean data.loading.cache_mb?"),
        (SIMULATED % "{campaign: {scans: many}}", "data.campaign.scans: cannot be many. Give: int"),
        ("seed_everythin: 3", "seed_everythin: no such option. Did you mean seed_everything?"),
        ("model: {class_path: os.system}", "os.system does not correspond to"),
        ("model: {class_path: SalsaNet}", "model: there is no class SalsaNet. Did you mean Salsa"),
        ("trainer: [1]", "trainer: "),
        ("trainer: " + 100 * "[", "mine.yaml: cannot be read as .yaml (nested more than"),
    ],
)
def test_a_configuration_is_refused_in_a_line(last_line, content, message) -> None:
    Path("mine.yaml").write_text(content)
    assert message in last_line(*FIT, "--config", "mine.yaml")
    assert not Path("runs").exists()


@pytest.mark.parametrize(
    "options",
    [
        ("--trainer.val_check_interval", "100"),
        ("--trainer.callbacks", "EarlyStopping", "--trainer.callbacks.monitor", "nonsense"),
    ],
)
def test_what_lightning_refuses_of_the_data_or_the_model_is_one_line(
    last_line, wads, options
) -> None:
    line = last_line("fit", *wads, "--trainer.max_epochs", "1", *options)
    assert line.startswith("--trainer: ")
    assert options[-1] in line


@pytest.mark.parametrize(
    ("labels", "option"),
    [(bytes(8), "--data.loading.columns"), (b"\x63" + bytes(11), "--data.card")],
)
def test_the_remedy_for_labels_names_an_option_of_training(last_line, labels, option) -> None:
    Path("scan.bin").write_bytes(bytes(48))
    Path("scan.label").write_bytes(labels)
    data = ("--data", "Folder", "--data.root", ".", "--data.card", "rehearse3d")
    parts = ("--data.train", "['scan.bin']", "--data.validation", "['scan.bin']")
    line = last_line("fit", "--model", "OutDet", *data, *parts)
    assert option in line
    assert f" --{option.rpartition('.')[2]}" not in line


def test_the_remedy_for_columns_is_an_option_that_is_taken(last_line) -> None:
    Path("scan.bin").write_bytes(bytes(20))
    Path("scan.label").write_bytes(bytes(4))
    data = ("--data", "Folder", "--data.root", ".", "--data.card", "wads")
    parts = ("--data.train", "['scan.bin']", "--data.validation", "['scan.bin']")
    line = last_line("fit", "--model", "OutDet", *data, *parts)
    remedy = shlex.split(line.rpartition("e.g. ")[2].removesuffix("."))
    assert remedy == ["--data.loading.columns", "[x,y,z,intensity,ring]"]
    assert "columns" not in last_line("fit", "--model", "OutDet", *data, *parts, *remedy)


@pytest.mark.parametrize(
    ("error", "raised"), [(ValueError("no"), InputError), (KeyError("fault"), KeyError)]
)
def test_what_lightning_refuses_is_a_line_and_its_faults_are_not(error, raised) -> None:
    with pytest.raises(raised), refusals_in_a_line():
        exec("raise error", {"__name__": "lightning.trainer", "error": error})
