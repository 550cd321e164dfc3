"""Where a training run writes: one line where it cannot, and nothing lost."""

from pathlib import Path

import pytest

SHORT = ("--trainer.max_epochs", "1")


def test_a_full_disk_is_one_line_and_leaves_the_earlier_checkpoint(
    last_line, wads, checkpoint, full_disk
) -> None:
    earlier = Path("saved/best.ckpt")
    earlier.parent.mkdir()
    earlier.write_bytes(checkpoint.read_bytes())
    full_disk()
    line = last_line("fit", *wads, *SHORT, "--checkpoint.dirpath", "saved")
    assert "saved/best.ckpt: cannot be written (File too large). Choose a folder" in line
    assert earlier.read_bytes() == checkpoint.read_bytes()
    assert list(earlier.parent.iterdir()) == [earlier]


@pytest.mark.parametrize("folder", ["file/below", "/proc/derain"])
def test_a_log_folder_that_cannot_be_written_is_one_line(last_line, wads, folder) -> None:
    Path("file").touch()
    line = last_line("fit", *wads, *SHORT, "--trainer.logger.save_dir", folder)
    assert line.startswith(str(Path.cwd() / folder))
    assert "cannot be written (" in line
    assert "--trainer.logger.save_dir" in line


def test_a_training_that_its_data_refuse_leaves_no_folder(last_line) -> None:
    Path("absent").mkdir()
    assert "absent" in last_line("fit", "--config", "outdet_wads.yaml", "--data.root", "absent")
    assert not list(Path("runs").iterdir())


def test_a_training_that_lightning_refuses_leaves_no_folder(last_line, wads) -> None:
    line = last_line("fit", *wads, *SHORT, "--trainer.val_check_interval", "100")
    assert "val_check_interval" in line
    assert not list(Path("runs").iterdir())


@pytest.mark.parametrize("command", ["validate", "test", "predict"])
def test_without_a_logger_a_configuration_of_the_same_name_stays(
    succeed, wads, checkpoint, command
) -> None:
    Path("config.yaml").write_text("seed_everything: 1  # mine")
    before = {*Path().iterdir(), Path("labels")}
    logger = ("--trainer.logger", "false", "--predictions.folder", "labels")
    succeed(command, *wads, *logger, "--ckpt_path", checkpoint)
    assert Path("config.yaml").read_text() == "seed_everything: 1  # mine"
    assert set(Path().iterdir()) <= before
