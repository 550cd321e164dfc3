"""Draws one scan as several methods clean it."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from derain.bags.names import within
from derain.cards.card import DataCard, load_card
from derain.cards.known import layouts_for
from derain.cli.outputs import print_lines
from derain.errors import InputError
from derain.sources.bag_frame import NUMBER, BagFrame
from derain.sources.folders import frame_of
from derain.system.extras import MATPLOTLIB, OPEN3D, require
from derain.system.notices import Notices
from derain.views.scan_issues import outside_view

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from derain.export.bench.bench_entries import BenchEntry
    from derain.scan import Scan
    from derain.sources.frame import Frame


def view_scan(arguments: argparse.Namespace) -> None:
    """Draws the scan.

    Raises:
        InputError: A scan or labels that cannot be read, an unknown method, or an output that
            cannot be written.
    """
    from derain.export.bench.bench_entries import bench_entries

    path = within(arguments.scans, arguments.topic)[0]
    if not (arguments.out or arguments.window):
        raise InputError(path, "no output is named", "Give --out, --window or --rerun.")
    require("view", MATPLOTLIB, *((OPEN3D,) if arguments.window else ()))
    methods = bench_entries(arguments.methods)
    card = None if arguments.card is None else load_card(arguments.card)
    frame = frame_of(path, arguments.columns, layouts_for(card))
    scan = frame.with_intensity_times(arguments.intensity_scale).read()
    notices = Notices()
    for method in methods:
        if method.spec_or_filter is not None:
            notices.warn(frame.name, method.spec_or_filter.issues(scan), method.title)
    truth = None if card is None else _truth(scan, frame, card)
    predicted = {
        method.title: _rain(scan, method, arguments.threads, notices) for method in methods
    }
    title, rain = f"{_shown(frame, path)}: {len(scan):,} points", None
    if truth is not None:
        rain, known = truth
        scan, rain = scan.take(known), rain[known]
        predicted = {name: called_rain[known] for name, called_rain in predicted.items()}
    if arguments.out:
        from derain.pictures.comparison import comparison_figure
        from derain.pictures.scan_pictures import save

        save(comparison_figure(scan, predicted, rain, title), arguments.out)
        print_lines(str(arguments.out))
    if arguments.window:
        from derain.pictures.comparison import show_comparison

        show_comparison(scan, predicted, rain)


def _shown(frame: "Frame", path: Path) -> str:
    """Name of a scan in the title; prints which cloud of a bag is drawn."""
    if not isinstance(frame, BagFrame):
        return path.name
    if NUMBER.fullmatch(path.name) is None:
        print_lines(f"{frame.name} is drawn, the first of {len(frame.clouds):,} clouds")
    return str(frame.path.relative_to(frame.clouds.bag.path.parent))


def _rain(
    scan: "Scan", method: "BenchEntry", threads: int, notices: Notices
) -> "NDArray[np.bool_]":
    """Points that a method calls rain, bool (N,); warns of many points outside a model's view."""
    from derain.export.runtime import Derainer
    from derain.system.stopwatch import Stopwatch

    judge = method.ready(threads)
    if not isinstance(judge, Derainer):
        return judge(scan, Stopwatch())
    judgement = judge.judge(scan)
    outside = outside_view(scan, judgement.judged, judge.spec.data)
    notices.warn(scan.name, outside, method.title)
    return judgement.rain


def _truth(
    scan: "Scan", frame: "Frame", card: DataCard
) -> "tuple[NDArray[np.bool_], NDArray[np.bool_]]":
    """Points that are rain, and points whose label is known, each bool (N,)."""
    labelled = scan.with_label(frame.read_label(len(scan)))
    return card.rain_of(labelled), ~card.unknown_of(labelled)
