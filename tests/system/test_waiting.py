"""Threads of a library that is imported sleep while they wait, unless the user has said."""

import os

import pytest

from derain.system.waiting import WAIT_POLICY, sleeping_threads


def test_what_is_imported_inside_is_told_to_sleep_and_nothing_else(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv(WAIT_POLICY, raising=False)
    with pytest.raises(ModuleNotFoundError, match="passive"), sleeping_threads():
        raise ModuleNotFoundError(os.environ[WAIT_POLICY])
    assert WAIT_POLICY not in os.environ


def test_what_the_user_has_said_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(WAIT_POLICY, "active")
    with sleeping_threads():
        assert os.environ[WAIT_POLICY] == "active"
    assert os.environ[WAIT_POLICY] == "active"
