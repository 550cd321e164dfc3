"""Processes of this machine: an error ends them at once, and what they answer must be sendable."""

import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest

from derain.jobs.workers import WorkerPool


def begin(file: Path, seconds: float) -> str:
    file.write_text("begun")
    time.sleep(seconds)
    return file.name


def test_an_error_ends_what_is_done_and_begins_nothing_more(tmp_path) -> None:
    files = [tmp_path / str(number) for number in range(4)]
    futures = []
    with suppress(KeyboardInterrupt), WorkerPool(1) as pool:
        futures = [pool.submit(begin, file, 600) for file in files]
        while not files[0].exists():
            time.sleep(0.01)
        raise KeyboardInterrupt
    assert [file.exists() for file in files] == [True, False, False, False]
    assert all(future.done() for future in futures)


def test_all_work_is_done_at_the_end_of_the_block(tmp_path) -> None:
    with WorkerPool(2) as pool:
        futures = [pool.submit(begin, tmp_path / str(number), 0) for number in range(5)]
    assert [future.result() for future in futures] == ["0", "1", "2", "3", "4"]


def test_an_answer_that_cannot_be_sent_is_an_error(tmp_path) -> None:
    with WorkerPool(1) as pool, pytest.raises(TypeError, match="cannot be sent"):
        pool.submit(threading.Lock).result()
