"""Filters judge what they see together as each would alone."""

import numpy as np
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
    for row, scores in zip(rows, together, strict=True):
        expected = np.zeros(4, np.int64)
        for scan in scans:
            called, rain = FilterDerainer(row.filter, 1)(scan), scan.label == 3
            for place, part in enumerate((rain & called, ~rain & called, rain & ~called)):
                expected[place] += np.count_nonzero(part & (scan.label != 9))
        pooled = scores.pooled
        counted_so = [pooled.true_positive, pooled.false_positive, pooled.false_negative]
        assert counted_so == expected[:3].tolist()
