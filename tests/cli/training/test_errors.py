"""A wrong option, key or value of Lightning's command line is one line that names the right one."""

from pathlib import Path

import pytest

SIMULATED = "data: {class_path: derain.datamodules.simulated.Simulated, init_args: %s}"


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def refusal(run_derain, *options: str) -> str:
    """The one line that a command is refused with."""
    outcome = run_derain("fit", "--config", "outdet_simulated.yaml", *options)
    assert (outcome.code, outcome.out) == (2, "")
    assert not list(Path().glob("runs"))
    *before, line = outcome.err.splitlines()
    assert all(other.endswith("Seed set to 0") for other in before)
    return line.removeprefix("derain: ")


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("--trainer.max_epoch", "3", "no such option. Did you mean --trainer.max_epochs?"),
        ("--data.campain.scans", "1", "no such option. Did you mean --data.campaign.scans?"),
        ("--model.learnin_rate", "1", "no such option. Did you mean --model.learning_rate?"),
        ("--trainer.logger.nam", "x", "no such option. Did you mean --trainer.logger.name?"),
        ("--checkpoint.moniter", "x", "no such option. Did you mean --checkpoint.monitor?"),
        ("--ckpt", "x", "no such option. Did you mean --ckpt_path?"),
        ("--colour_of_the_sky", "x", "no such option. All options: --help-all."),
        ("--trainer.max_epochs", "three", "cannot be three. Give: int."),
        ("--data.campaign.scans", "[3]", "cannot be [3]. Give: int."),
    ],
)
def test_an_option_is_refused_in_a_line(run_derain, option: str, value: str, said: str) -> None:
    assert refusal(run_derain, option, value) == f"{option}: {said}"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("trainer: {max_epoch: 3}", "trainer.max_epoch: no such option. Did you mean trainer.max_"),
        (
            SIMULATED % "{loading: {kept_megabytes: 1}}",
            "data.loading.kept_megabytes: no such option. Did you mean data.loading.cache_mb?",
        ),
        ("seed_everythin: 3", "seed_everythin: no such option. Did you mean seed_everything?"),
        (SIMULATED % "{rot: x}", "data.rot: no such option. Did you mean data.root?"),
        (SIMULATED % "{campaign: {scans: many}}", "data.campaign.scans: cannot be many. Give: int"),
        ("model: {class_path: os.system}", "model: Import path os.system does not correspond to"),
        ("trainer: [1]", "trainer: [1] is not a mapping."),
        ("[1, 2]", "[1, 2] is not a mapping."),
        ("a: &a [1]\nb: [*a, *a]", "cannot be read as .yaml (the alias *a"),
        ("trainer: " + 100 * "[", "cannot be read as .yaml (nested more than"),
    ],
)
def test_a_configuration_is_refused_in_a_line(run_derain, content: str, said: str) -> None:
    Path("mine.yaml").write_text(content)
    assert refusal(run_derain, "--config", "mine.yaml").startswith(f"mine.yaml: {said}")


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--model.learning_rate", "-1"),
        ("--model.learning_rate", "1e400"),
        ("--model.neighbours", "0"),
        ("--model.neighbours", "1000000000"),
        ("--data.loading.batch_size", "0"),
        ("--data.loading.workers", "-1"),
        ("--seed_everything", "-1"),
        ("--seed_everything", "100000000000000000000"),
        ("--trainer.devices", "-1"),
        ("--trainer.strategy", "foo"),
        ("--trainer.accumulate_grad_batches", "0"),
        ("--panels.pictures", "-1"),
    ],
)
def test_a_value_that_cannot_be_is_refused_by_its_option(
    run_derain, option: str, value: str
) -> None:
    assert option.split(".")[-1].removeprefix("--") in refusal(run_derain, f"{option}={value}")


def test_what_the_trainer_cannot_use_is_one_line(run_derain) -> None:
    line = refusal(run_derain, "--trainer.max_epochs", "-3")
    assert line.startswith("--trainer: `max_epochs` must be")
    assert line.endswith("You passed in -3. Correct the option that it names.")
