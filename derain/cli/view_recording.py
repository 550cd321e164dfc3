"""Writes a recording as several methods clean it, for Rerun's viewer."""

import argparse
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from tqdm import tqdm

from derain.bags.names import within
from derain.cards.card import load_card
from derain.cards.known import layouts_for
from derain.cli.outputs import print_lines
from derain.errors import InputError
from derain.export.methods import load_method, named_method, split_title
from derain.files.atomic import require_writable
from derain.files.reading import reading
from derain.sources.folders import named_frames
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.method import Method
from derain.sources.recordings import irregularities
from derain.system.extras import RERUN
from derain.system.memory import keep_freed_memory
from derain.system.notices import Notices, warn
from derain.workflows.odometry import placed

if TYPE_CHECKING:
    from derain.pictures.selection import Labels, Selection

SUFFIX = ".rrd"


def view_recording(arguments: argparse.Namespace) -> int:
    """Writes the file, and prints its size.

    Returns:
        The exit code: 2 where something could not be shown.

    Raises:
        InputError: Rerun is not installed; a method that there is not; scans or poses that cannot
            be read; a file that cannot be written.
    """
    out: Path = arguments.rerun
    refuse_unusable(out)
    from derain.pictures.selection import Labels, Selection

    keep_freed_memory()
    methods = _methods(arguments.methods, arguments.threads)
    card = None if arguments.card is None else load_card(arguments.card)
    found = named_frames(
        within(arguments.scans, arguments.topic),
        arguments.columns,
        labelled=card is not None,
        layouts=layouts_for(card),
        recordings=True,
    )
    source = placed(found, arguments.poses, arguments.threads).map(
        lambda frame: frame.with_intensity_times(arguments.intensity_scale)
    )
    numbers = range(len(source))[arguments.frames][:: arguments.every]
    selection = Selection(source, numbers)
    if card is not None and not any(frame.has_labels for frame in selection.frames):
        warn(f"{selection.frames[0].name}: no scan has labels, so no truth is shown")
        card = None
    for method in methods.values():
        for sentence in irregularities(source, method.window):
            warn(sentence)
    return write_and_report(out, selection, methods, None if card is None else Labels(card))


def refuse_unusable(out: Path) -> None:
    """Refuses, before any work, a file that cannot be written or that no viewer would open.

    Raises:
        InputError: Rerun is not installed, another suffix, or a folder that is not writable.
    """
    RERUN.load(out)
    if out.suffix.lower() != SUFFIX:
        raise InputError(out, f"must end in {SUFFIX}", "Rerun's viewer opens no other files.")
    require_writable(out)


def write_and_report(
    out: Path,
    selection: "Selection",
    methods: dict[str, Method],
    labels: "Labels | None",
) -> int:
    """Writes the file, and prints what it shows, its size and what is wrong with its scans.

    Returns:
        The exit code: 2 where something could not be shown.

    Raises:
        InputError: No scan that can be read, or a file that cannot be written.
    """
    from derain.pictures.playback import write_playback

    scans = len(selection.frames)
    print_lines(f"{scans:,} scans, methods: {', '.join(methods)}")
    notices, errors = Notices(), set()

    @contextmanager
    def reporting(frame: Frame) -> Iterator[None]:
        """Prints an error and goes on; once, for every method reads the frame again."""
        try:
            with reading(Path(frame.name)):
                yield
        except InputError as error:
            if str(error) not in errors:
                tqdm.write(f"derain: {error}", sys.stderr)
            errors.add(str(error))

    def watch(title: str, judgement: Judgement) -> None:
        assert judgement.frame is not None
        notices.warn(judgement.frame.name, methods[title].issues(judgement), title)

    write_playback(out, selection, methods, labels, reporting, watch)
    notices.warn_of_repeats()
    print_lines(f"{out}: {out.stat().st_size / 1e6:,.1f} MB. To view it: rerun {out}")
    if errors:
        print(f"derain: not all of the {scans:,} scans could be shown", file=sys.stderr)
    return 2 if errors else 0


def _methods(names: Sequence[str], threads: int) -> dict[str, Method]:
    """The methods by their titles, in order.

    Raises:
        InputError: No such method, or two of one title.
    """
    methods: dict[str, Method] = {}
    for text in names:
        title, name = split_title(text)
        if title in methods:
            raise InputError(
                title, "is the title of two methods", "Give titles: `first=a.onnx second=dror`."
            )
        methods[title] = load_method(*named_method(name), threads)
    return methods
