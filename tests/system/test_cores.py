"""Cores that a process may use: those it may run on, within its share of their time."""

import os

import pytest

from derain.errors import InputError
from derain.system import cores
from derain.system.cores import WAIT_POLICY, sleeping_threads, threads_of, usable_cores


def version_1(group: str, quota: int, period: int = 100_000) -> dict[str, str]:
    return {f"{group}/cpu.cfs_quota_us": f"{quota}\n", f"{group}/cpu.cfs_period_us": f"{period}\n"}


@pytest.mark.parametrize(
    ("membership", "files", "expected"),
    [
        # Version 2, in a name space of its own, on the machine, and below a group with a quota.
        ("0::/\n", {"cpu.max": "200000 100000\n"}, 2),
        ("0::/a/b\n", {"a/b/cpu.max": "50000 10000\n"}, 5),
        ("0::/a/b\n", {"a/b/cpu.max": "700000 100000", "a/cpu.max": "300000 100000"}, 3),
        ("0::/a/b\n", {"a/b/cpu.max": "max 100000", "a/cpu.max": "300000 100000"}, 3),
        ("0::/docker/1f\n", {"cpu.max": "400000 100000\n"}, 4),
        # Part of a core's time takes one more core, and there is always one.
        ("0::/\n", {"cpu.max": "250000 100000\n"}, 3),
        ("0::/\n", {"cpu.max": "1000 100000\n"}, 1),
        ("0::/\n", {"cpu.max": "6400000 100000\n"}, 8),
        # Version 1, among other controllers.
        ("5:memory:/a\n4:cpu,cpuacct:/a\n0::/\n", version_1("cpu,cpuacct/a", 300_000), 3),
        ("4:cpu:/docker/1f\n", version_1("cpu", 150_000), 2),
        ("4:cpu:/\n", version_1("cpu", -1), 8),
        ("4:cpuset:/\n", version_1("cpuset", 100_000), 8),
        # Absent or odd: no quota.
        ("", {"cpu.max": "100000 100000\n"}, 8),
        ("0::/\n", {}, 8),
        ("\xff\xfe", {}, 8),
        ("nonsense\n", {"cpu.max": "100000 100000\n"}, 8),
        ("0::/\n", {"cpu.max": "100000 0\n"}, 8),
        ("0::/\n", {"cpu.max": "9" * 5000 + " 1\n"}, 8),
    ],
)
def test_a_share_of_time_limits_the_cores(
    tmp_path, monkeypatch, membership, files, expected
) -> None:
    monkeypatch.setattr(cores, "_allowed_cores", lambda: 8)
    monkeypatch.setattr(cores, "MEMBERSHIP", tmp_path / "cgroup")
    monkeypatch.setattr(cores, "GROUPS", tmp_path / "groups")
    (tmp_path / "cgroup").write_bytes(membership.encode("latin-1"))
    for name, content in files.items():
        path = tmp_path / "groups" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)
    assert usable_cores() == expected


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="the system has no affinity")
def test_where_there_are_no_control_groups_it_is_the_cores_it_may_run_on(
    tmp_path, monkeypatch
) -> None:
    monkeypatch.setattr(cores, "MEMBERSHIP", tmp_path / "none")
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
