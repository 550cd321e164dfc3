"""A program is warned of what is odd about scans, once of each kind."""

import warnings
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from derain.errors import ScanWarning
from derain.evaluation.hard_cases import scene
from derain.export.methods import load_method
from derain.export.runtime import Derainer
from derain.filters import DROR, FilterDerainer
from derain.recordings.persistence import PersistenceDerainer
from derain.scan import Float32s, Scan
from derain.sources.judgement import Judgement
from derain.views.scan_issues import ScanIssue


def warned(judge: Callable[[], object]) -> list[warnings.WarningMessage]:
    """Warnings of scans while something is done."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        judge()
    return [each for each in caught if each.category is ScanWarning]


def in_millimetres() -> Float32s:
    points = scene(600)
    points[:, :3] *= 1000
    return points


@pytest.mark.parametrize(
    "make",
    [Derainer, lambda: FilterDerainer(DROR()), PersistenceDerainer],
    ids=["model", "filter", "persistence"],
)
def test_every_kind_of_method_warns_of_another_unit_once(make) -> None:
    method, points = make(), in_millimetres()

    def push() -> None:
        for factor in (1, 2):
            method.push(factor * points)
        list(method.flush())

    of_units = [each for each in warned(push) if "millimetres" in str(each.message)]
    assert len(of_units) == 1


def test_a_warning_names_the_line_that_asked_for_the_judgement() -> None:
    found = warned(lambda: FilterDerainer(DROR())(in_millimetres()))
    assert {each.filename for each in found} == {__file__}


def test_a_method_that_is_loaded_for_a_command_does_not_warn() -> None:
    assert not warned(lambda: load_method("dror", {}).push(in_millimetres()))


class Examined(FilterDerainer):
    """Counts the scans that it examines, one in three."""

    EXAMINE_EVERY = 3

    def __init__(self) -> None:
        super().__init__(DROR())
        self.examined: list[int] = []

    def issues(self, judgement: Judgement) -> Iterator[ScanIssue]:
        self.examined.append(len(judgement.scan))
        yield ScanIssue("odd", "it is odd")


def test_one_scan_in_so_many_is_examined_and_the_share_of_rain_looked_at_in_each() -> None:
    method, texts = Examined(), []
    for points in range(1, 6):
        rain = np.full(points, points == 2)
        answer = Judgement(rain.astype(np.float32), rain, ~rain, Scan.of(np.ones((points, 3))))
        found = warned(lambda answer=answer: method.with_warnings(answer))
        texts += [str(each.message) for each in found]
    assert method.examined == [1, 4]
    assert texts[0] == "array: it is odd"
    assert "100% of the points are called rain" in texts[1]
    assert len(texts) == 2
