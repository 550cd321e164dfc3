"""Writes a recording as several methods clean it, to be looked at in Rerun's viewer."""

import argparse
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from tqdm import tqdm

from derain.cards.card import load_card
from derain.cards.known import layouts_for
from derain.cli.bag_options import in_topic
from derain.cli.outputs import refuse_unwritable, say
from derain.cli.pose_options import placed
from derain.errors import InputError
from derain.export.methods import load_method, named_method, titled
from derain.files.reading import reading
from derain.sources.folders import named_frames
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.method import Method
from derain.sources.recordings import irregularities
from derain.system.extras import RERUN
from derain.system.memory import keep_freed_memory
from derain.system.notices import Notices, warn

if TYPE_CHECKING:
    from derain.playback.labels import Labels
    from derain.playback.selection import Selection

SUFFIX = ".rrd"


def view_recording(arguments: argparse.Namespace) -> int:
    """Writes the file, and says how large it becomes and is.

    Returns:
        The exit code: 2 where something could not be shown.

    Raises:
        InputError: Rerun is not installed; a method that there is not; scans or poses that cannot
            be read; a file that cannot be written.
    """
    out: Path = arguments.rerun
    refuse_unusable(out)
    from derain.playback.labels import Labels
    from derain.playback.selection import Selection

    keep_freed_memory()
    methods = _methods(arguments.methods, arguments.threads)
    card = None if arguments.card is None else load_card(arguments.card)
    found = named_frames(
        in_topic(arguments.scans, arguments),
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
        warn(f"{selection.frames[0].name}: no scan has labels, and so there is no truth")
        card = None
    for method in methods.values():
        for sentence in irregularities(source, method.window):
            warn(sentence)
    return write_told(out, selection, methods, None if card is None else Labels(card))


def refuse_unusable(out: Path) -> None:
    """Refuses, before any work, a file that could not be written or that no viewer would open.

    Raises:
        InputError: Rerun is not installed, another suffix, or a folder that is not writable.
    """
    RERUN.load(out)
    if out.suffix.lower() != SUFFIX:
        raise InputError(out, f"must end in {SUFFIX}", "Rerun's viewer opens no other files.")
    refuse_unwritable(out)


def write_told(
    out: Path,
    selection: "Selection",
    methods: dict[str, Method],
    labels: "Labels | None",
) -> int:
    """Writes the file, and tells of it on the screen before and after.

    Returns:
        The exit code: 2 where something could not be shown.

    Raises:
        InputError: No scan that can be read, or a file that cannot be written.
    """
    from derain.playback.playback import write_playback
    from derain.playback.sensor_look import SensorLook
    from derain.playback.size import LARGE, megabytes

    look = SensorLook.of(selection.frames)
    scans = len(selection.frames)
    expected = look.expected_bytes(scans, len(methods))
    say(
        f"{scans:,} scans of about {look.points:,} points, methods: {', '.join(methods)}. {out} "
        f"will take about {megabytes(expected)}"
    )
    if expected > LARGE:
        warn(f"{out}: the viewer keeps all of it in memory; --every 10 shows one scan of ten")
    passing, notices = _Passing(), Notices()

    def watch(title: str, judgement: Judgement) -> None:
        assert judgement.frame is not None
        notices.tell(judgement.frame.name, methods[title].oddities(judgement), title)

    write_playback(out, selection, look, methods, labels, passing.over, watch)
    notices.tell_how_many_more()
    say(f"{out}: {megabytes(out.stat().st_size)}. Look at it: rerun {out}")
    if passing.told:
        print(f"derain: of {scans:,} scans not all could be shown", file=sys.stderr)
    return 2 if passing.told else 0


class _Passing:
    """Tells what is wrong with scans, each fault once, and lets the others go on.

    Attributes:
        told: What was told.
    """

    def __init__(self) -> None:
        self.told: set[str] = set()

    @contextmanager
    def over(self, frame: Frame) -> Iterator[None]:
        """Holds an error back.

        Args:
            frame: What the block works on; every method reads it again, and fails again.
        """
        try:
            with reading(Path(frame.name)):
                yield
        except InputError as error:
            if str(error) not in self.told:
                tqdm.write(f"derain: {error}", sys.stderr)
            self.told.add(str(error))


def _methods(names: Sequence[str], threads: int) -> dict[str, Method]:
    """The methods by their titles, in order.

    Raises:
        InputError: No such method, or two of one title.
    """
    methods: dict[str, Method] = {}
    for text in names:
        title, name = titled(text)
        if title in methods:
            raise InputError(
                title, "two methods are called so", "Give titles, as in `first=a.onnx second=dror`."
            )
        methods[title] = load_method(*named_method(name), threads)
    return methods
