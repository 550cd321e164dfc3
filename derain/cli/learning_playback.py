"""What ``derain learn`` shows in Rerun's viewer: teacher and student, scan after scan."""

from pathlib import Path

from derain.cli.learning_report import LearningReport
from derain.cli.view_recording import write_and_report
from derain.export.runtime import Derainer
from derain.playback.selection import Labels, Selection
from derain.sources.frame import Frame
from derain.sources.source import Frames
from derain.sources.spread import evenly_spaced

# Of a long recording so many scans are shown, spread over all of it.
MOST_SHOWN = 100

STUDENT_TITLE = "student"


def show_lesson(report: LearningReport, out: Path) -> None:
    """Writes the file: the teacher's labels, and what the finished model says.

    Args:
        report: What was told of the lesson.
        out: The file, ``.rrd``.

    Raises:
        InputError: A file that cannot be written.
    """
    frames = sorted([*report.data.frames("train"), *report.held_out], key=_in_time)
    shown = evenly_spaced(range(len(frames)), MOST_SHOWN)
    held_out = frozenset(frame.key for frame in report.held_out)
    selection = Selection(Frames(frames), shown, held_out)
    student = Derainer(report.lesson.out)
    write_and_report(out, selection, {STUDENT_TITLE: student}, Labels(report.data.card, "teacher"))


def _in_time(frame: Frame) -> tuple[str, int]:
    return frame.sequence, frame.number
