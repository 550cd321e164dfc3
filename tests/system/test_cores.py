"""Cores that a process may use: those it may run on, within its share of their time."""

import os

import pytest

from derain.errors import InputError
from derain.system import cores
from derain.system.cores import WAIT_POLICY, sleeping_threads, threads_of, usable_cores


@pytest.mark.parametrize(
    ("limit", "expected"),
    [
        ("200000 100000\n", 2),
        ("50000 10000\n", 5),
        # Part of a core's time takes one more core, and there is always one.
        ("250000 100000\n", 3),
        ("1000 100000\n", 1),
        ("6400000 100000\n", 8),
        # Absent or odd: no quota.
        ("max 100000\n", 8),
        ("nonsense\n", 8),
        ("9" * 5000 + " 1\n", 8),
    ],
)
def test_a_share_of_time_limits_the_cores(tmp_path, monkeypatch, limit, expected) -> None:
    monkeypatch.setattr(cores, "_allowed_cores", lambda: 8)
    monkeypatch.setattr(cores, "GROUP_LIMIT", tmp_path / "cpu.max")
    (tmp_path / "cpu.max").write_text(limit)
    assert usable_cores() == expected


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="the system has no affinity")
def test_where_there_are_no_control_groups_it_is_the_cores_it_may_run_on(
    tmp_path, monkeypatch
) -> None:
    monkeypatch.setattr(cores, "GROUP_LIMIT", tmp_path / "none")
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    try:
        assert usable_cores() == 1
    finally:
        os.sched_setaffinity(0, before)
    assert usable_cores() == len(before)


def test_threads_are_a_whole_number_and_none_are_one_for_each_core() -> None:
    assert threads_of(0) == usable_cores()
    assert threads_of(3) == 3
    for threads in (-1, 1.5, "2", None, 10**6):
        with pytest.raises(InputError, match="threads: "):
            threads_of(threads)


@pytest.mark.parametrize(("user", "inside"), [(None, "passive"), ("active", "active")])
def test_what_is_imported_inside_is_set_to_sleep_unless_the_user_has_set_it(
    monkeypatch, user, inside
) -> None:
    monkeypatch.delenv(WAIT_POLICY, raising=False)
    if user is not None:
        monkeypatch.setenv(WAIT_POLICY, user)
    with pytest.raises(ModuleNotFoundError, match=inside), sleeping_threads():
        raise ModuleNotFoundError(os.environ[WAIT_POLICY])
    assert os.environ.get(WAIT_POLICY) == user
