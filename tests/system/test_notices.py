"""What is odd about scans is printed once for each kind, and counted."""

from derain.system.notices import Notices
from derain.views.scan_issues import ScanIssue


def test_each_kind_is_printed_with_its_first_scan_and_counted(capsys) -> None:
    notices = Notices()
    none, unit = ScanIssue("no intensity", "no intensity here"), ScanIssue("another unit", "0..1")
    notices.warn("a", [none])
    notices.warn("b", [none, unit])
    notices.warn("c\x1b[2J", [ScanIssue("no intensity", "nor here")])
    notices.warn("d", [none], method="outdet")
    notices.warn_of_repeats()
    assert capsys.readouterr().err.splitlines() == [
        "derain: warning: a: no intensity here",
        "derain: warning: b: 0..1",
        "derain: warning: d: outdet: no intensity here",
        "derain: warning: 2 more scans: no intensity",
    ]
