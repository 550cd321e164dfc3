"""Writes a recording as several methods clean it, for Rerun's viewer."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from derain.cards.card import DataCard
from derain.cli.outputs import print_error, print_lines
from derain.errors import InputError
from derain.export.methods import load_method, named_method, split_title
from derain.files.atomic import require_writable
from derain.sources.judgement import Judgement
from derain.sources.judging import Failures
from derain.sources.method import Method
from derain.sources.recordings import irregularities
from derain.sources.source import Source
from derain.system.extras import RERUN
from derain.system.notices import Notices, warn

if TYPE_CHECKING:
    from derain.pictures.selection import Labels, Selection

SUFFIX = ".rrd"


def view_recording(
    out: Path,
    methods: dict[str, Method],
    source: Source,
    numbers: Sequence[int],
    card: DataCard | None,
) -> int:
    """Writes the file, and prints its size.

    Args:
        out: The file, which :func:`refuse_unusable` has let pass.
        methods: The methods by their titles.
        source: All scans.
        numbers: The places of the scans to show, ascending.
        card: Data card of the scans' labels; None shows no truth.

    Returns:
        The exit code: 2 where something could not be shown.

    Raises:
        InputError: Scans or poses that cannot be read, or a file that cannot be written.
    """
    from derain.pictures.selection import Labels, Selection

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
    out: Path, selection: "Selection", methods: dict[str, Method], labels: "Labels | None"
) -> int:
    """Writes the file, and prints what it shows, its size, and errors of single scans.

    Returns:
        The exit code: 2 where something could not be shown.

    Raises:
        InputError: No scan that can be read, or a file that cannot be written.
    """
    from derain.pictures.playback import write_playback

    scans = len(selection.frames)
    print_lines(f"{scans:,} scans, methods: {', '.join(methods)}")
    notices = Notices()
    errors: set[str] = set()

    def print_once(error: InputError) -> None:
        """Prints an error the first time: every method reads the frame again."""
        if str(error) not in errors:
            print_error(error)
        errors.add(str(error))

    def watch(title: str, judgement: Judgement) -> None:
        assert judgement.frame is not None
        notices.warn(judgement.frame.name, methods[title].issues(judgement), title)

    write_playback(out, selection, methods, labels, Failures(print_once).skipping_failures, watch)
    notices.warn_of_repeats()
    print_lines(f"{out}: {out.stat().st_size / 1e6:,.1f} MB. To view it: rerun {out}")
    if errors:
        print(f"derain: not all of the {scans:,} scans could be shown", file=sys.stderr)
    return 2 if errors else 0


def load_methods(names: Sequence[str], threads: int) -> dict[str, Method]:
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
