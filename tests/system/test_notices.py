"""What is odd about scans is told once for each kind, and counted."""

import pytest

from derain.system.notices import Notices
from derain.views.oddities import Oddity


def test_each_kind_is_told_with_its_first_scan_and_counted(
    capsys: pytest.CaptureFixture[str],
) -> None:
    notices = Notices()
    none, unit = Oddity("no intensity", "no intensity here"), Oddity("another unit", "0..1")
    notices.tell("a", [none])
    notices.tell("b", [none, unit])
    notices.tell("c\x1b[2J", [Oddity("no intensity", "nor here")])
    notices.tell("d", [none], method="outdet")
    notices.tell_how_many_more()
    assert capsys.readouterr().err.splitlines() == [
        "derain: warning: a: no intensity here",
        "derain: warning: b: 0..1",
        "derain: warning: d: outdet: no intensity here",
        "derain: warning: 2 more scans: no intensity",
    ]
