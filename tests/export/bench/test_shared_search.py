"""Filters judge what they see together as each would alone."""

import pytest

from derain.evaluation.scores import score
from derain.export.bench.bench import scored_methods
from derain.export.bench.bench_entries import bench_entries
from derain.export.bench.labelled_frames import LabelledFrames
from derain.filters import FILTERS, FilterDerainer
from derain.scan import Scan
from derain.views.neighbours import NeighbourView


def test_filters_share_one_search_and_score_as_they_would_alone(
    labelled: LabelledFrames, monkeypatch: pytest.MonkeyPatch
) -> None:
    searches = []
    view = NeighbourView.__call__

    def counted(self: NeighbourView, scan: Scan) -> object:
        searches.append(self.neighbours)
        return view(self, scan)

    rows = bench_entries(list(FILTERS))
    monkeypatch.setattr(NeighbourView, "__call__", counted)
    scans = list(map(labelled.read, labelled.frames))
    together = score(scored_methods(rows, threads=1), scans, labelled.card)
    assert searches == [9, 9, 9]  # SSR looks at the most
    monkeypatch.undo()
    alone = [FilterDerainer(row.filter, threads=1) for row in rows]
    assert together == score(alone, scans, labelled.card)
