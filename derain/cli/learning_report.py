"""The report of ``derain learn``: text and pictures, written as far as the lesson has come."""

from typing import TYPE_CHECKING

from tqdm import tqdm

from derain.cli.learning_record import record_of
from derain.cli.learning_text import LEAST_RAIN, Learnt, as_markdown, summary
from derain.cli.lesson import Lesson
from derain.cli.narration import Narrator
from derain.datamodules.taught import Taught
from derain.errors import InputError
from derain.evaluation.answers import Answers, AnswersOfScan
from derain.export.runtime import Derainer
from derain.files.atomic import replacing
from derain.odometry.posed import STANDING
from derain.pictures.answers import answers_figure, removed_figure, teacher_figure
from derain.pictures.scan_pictures import before_after_figure, save
from derain.sources.frame import Frame
from derain.sources.spread import evenly_spaced

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Of a long recording so many scans are counted, and so many held-out ones asked and drawn.
MOST_COUNTED = 300
MOST_ASKED = 50
DRAWN = 3


class LearningReport:
    """What is told of a lesson, gathered step by step.

    Args:
        lesson: What is learnt from what; its teacher has labelled the scans.
        narrator: What ran the commands.

    Attributes:
        held_out: The scans that the student does not learn from, in time order.
        path: The file.

    Raises:
        InputError: A scan that cannot be read, or labels without one to learn from.
    """

    def __init__(self, lesson: Lesson, narrator: Narrator) -> None:
        self.lesson = lesson
        self.narrator = narrator
        self.path = lesson.work / "report.md"
        self.data = Taught(str(lesson.taught))
        self.held_out: list[Frame] = list(self.data.frames("validation"))
        learnt_from = evenly_spaced(self.data.frames("train"), MOST_COUNTED)
        frames = [*learnt_from, *evenly_spaced(self.held_out, MOST_ASKED)]
        kept_back = {frame.key for frame in self.held_out}
        self.learnt = Learnt(
            title=", ".join(map(str, lesson.recordings)),
            teacher=lesson.teacher,
            student=lesson.student,
            scans=[
                AnswersOfScan(frame.key, frame.key in kept_back, self._answers(frame))
                for frame in tqdm(sorted(frames, key=_in_time), "counting", disable=None)
            ],
            stood=lesson.poses == STANDING,
            sees_intensity=not lesson.blind,
        )

    @property
    def summary(self) -> str:
        """A few sentences for the screen."""
        return summary(self.learnt)

    def refuse_clean(self) -> None:
        """Refuses to train on a recording in which the teacher has found nothing to learn.

        Raises:
            InputError: No point of which it is sure, or hardly any rain among them.
        """
        taught = self.learnt.taught
        if taught.shares[2] == 1 or not taught.points:
            raise InputError(
                self.learnt.title,
                f"{self.learnt.teacher} is sure of no point, so that there is nothing to learn",
                f"See {self.path}: the scans have to follow one another, and to overlap.",
            )
        if taught.rain_among_known < LEAST_RAIN:
            raise InputError(
                self.learnt.title,
                f"hardly any rain was found ({taught.rain_among_known:.3%} of the points that "
                f"{self.learnt.teacher} is sure of): it seems to be clean",
                f"Record in rain. What was found: {self.path}.",
            )

    def ask_the_student(self) -> None:
        """Has the finished model judge held-out scans, and draws some of them.

        Raises:
            InputError: A scan that cannot be read.
        """
        derainer = Derainer(self.lesson.out)
        asked = evenly_spaced(self.held_out, MOST_ASKED)
        self.learnt.asked = [
            AnswersOfScan(frame.key, True, self._answers(frame, derainer))
            for frame in tqdm(asked, "asking the student", disable=None)
        ]
        for number, frame in enumerate(evenly_spaced(self.held_out, DRAWN), 1):
            self._draw(frame, derainer, number)
        if self.lesson.card is not None:
            self.learnt.record = record_of(asked, self.data.card, self.lesson.card, derainer)

    def write(self) -> None:
        """Writes the text and the pictures of all scans together.

        Raises:
            InputError: An output that cannot be written.
        """
        learnt = self.learnt
        learnt.warned, learnt.steps = self.narrator.warned, self.narrator.commands
        figure = teacher_figure(learnt.scans, f"What {learnt.teacher} says")
        self._save(figure, "teacher.png", "shares of rain, not rain and not known")
        if learnt.asked:
            figure = removed_figure(learnt.student_says, "Removed from held-out scans, by range")
            self._save(figure, "removed.png", "share removed by range")
        with replacing(self.path) as temporary:
            temporary.write_text(as_markdown(learnt), "utf-8")

    def _answers(self, frame: Frame, derainer: Derainer | None = None) -> Answers:
        scan = self.data.read_measured(frame)
        called_rain = None if derainer is None else derainer(scan)
        return Answers.of(scan, self.data.card, called_rain)

    def _draw(self, frame: Frame, derainer: Derainer, number: int) -> None:
        """Draws a held-out scan before and after, and the student beside the teacher."""
        scan = self.data.read(frame)
        called_rain = derainer(scan)
        heading = f"{frame.key}: cleaned by {self.learnt.student}, which did not learn from it"
        figure = before_after_figure(scan, called_rain, heading)
        self._save(figure, f"held_out_{number}.png", f"{frame.key} before and after")
        heading = f"{frame.key}: what {self.learnt.teacher} says, and {self.learnt.student}"
        figure = answers_figure(scan, self.data.card, called_rain, heading)
        self._save(figure, f"held_out_{number}_beside.png", f"{frame.key}: teacher and student")

    def _save(self, figure: "Figure", name: str, shows: str) -> None:
        path = self.path.with_name(name)
        save(figure, path)
        self.learnt.pictures[path] = shows


def _in_time(frame: Frame) -> tuple[str, int]:
    return frame.sequence, frame.number
