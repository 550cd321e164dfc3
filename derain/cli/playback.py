"""Writes recordings for Rerun's viewer, and prints the result."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from derain.cli.outputs import print_error, print_lines
from derain.errors import InputError, counted
from derain.files.atomic import require_writable
from derain.sources.judgement import Judgement
from derain.sources.judging import Failures
from derain.sources.method import Method
from derain.system.extras import RERUN
from derain.system.notices import Notices

if TYPE_CHECKING:
    from derain.pictures.selection import Labels, Selection

SUFFIX = ".rrd"


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
    out: Path, selection: "Selection", methods: Mapping[str, Method], labels: "Labels | None"
) -> int:
    """Writes the file, and prints its contents, its size, and errors of single scans.

    Args:
        out: The file, which :func:`refuse_unusable` has let pass.
        selection: The scans to show.
        methods: The methods by their titles.
        labels: Labels of the scans; None shows no truth.

    Returns:
        The exit code: 2 where something could not be shown.

    Raises:
        InputError: No scan that can be read, or a file that cannot be written.
    """
    from derain.pictures.playback import write_playback

    scans = len(selection.frames)
    print_lines(f"{counted(scans, 'scan')}, methods: {', '.join(methods)}")
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
