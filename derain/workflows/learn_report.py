"""The report on a network that a teacher has taught: how far to trust it, and when not to."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from derain.evaluation.answers import Answers
from derain.evaluation.text_tables import markdown_table, number_text
from derain.files.atomic import write_text

# Shares of rain among the points that a teacher is sure of. Less than a thousandth of a scan is
# what a few moving things make of clean air. Of simulated dry streets persistence calls up to .7 %
# rain, the leaves and boughs (BENCHMARK.md): such a recording is learnt from, with a warning.
LEAST_RAIN = 0.001
DOUBTFUL_RAIN = 0.01

# Bounds beyond which the report raises no doubt. They change no result; they only direct the
# reader's attention.
ENOUGH_SCANS = 10
ENOUGH_KNOWN = 0.7
ENOUGH_AGREEMENT = 0.7
ENOUGH_RAIN = 1000
MORE_THAN_TAUGHT = 1.5
MORE_BY = 0.005

ALWAYS = """\
- The held-out scans are of the same drive as those that the student learnt from. They do
  not measure another sensor, another mounting, heavier rain or another kind of rain.
- Agreement is not truth: the student also learns errors that the teacher repeats, such as on cars
  that move as it does, and the agreement does not show them. The pictures do: look for blue on
  things.
- Run the model on a recording in dry air, and check that it removes nothing: `derain run` prints
  the share."""

AGREEMENT_EXPLAINED = """\
P, R and IoU compare the student with the teacher as if that were the truth, on the points of
held-out scans that the teacher is sure of. A student can be better than its teacher: it does not
learn errors that the teacher makes only occasionally."""


BESIDE_PERSISTENCE = """\
Persistence uses free space alone: a point is rain if rays of the scans before and after pass
through its place, at any brightness. Compared with this teacher on held-out scans:"""


@dataclass
class LearnResults:
    """The results of learning from a recording.

    Attributes:
        title: The recording.
        teacher: Name of the teacher.
        student: Name of the network, and what it sees.
        model: The ONNX file.
        path: File of the report.
        taught: The teacher's answers of all scans, also of those that it left out.
        trained_on: Number of scans that the student learns from.
        held_out: Number of scans that are held out.
        agreement: The student's answers beside the teacher's on held-out scans; of no point before
            it is trained.
        persistence: Persistence's answers on held-out scans, and beside them what the teacher calls
            rain; None where they are not compared.
        stood: True if the sensor was at rest, by the configuration.
        sees_intensity: True if the student does, in the unit of this recording.
        warnings: Warnings of all steps, in order.
        pictures: Title of each picture, by file in the folder of the report.
        commands: Commands that repeat the steps.
    """

    title: str
    teacher: str
    student: str
    model: Path
    path: Path
    taught: Answers
    trained_on: int
    held_out: int
    agreement: Answers = field(default_factory=Answers)
    persistence: Answers | None = None
    stood: bool = False
    sees_intensity: bool = True
    warnings: Sequence[str] = ()
    pictures: dict[Path, str] = field(default_factory=dict)
    commands: Sequence[str] = ()

    def __str__(self) -> str:
        """Two or three sentences."""
        _, rain, unknown = self.taught.shares
        text = (
            f"{self.teacher} labels {self.trained_on + self.held_out:,} scans: "
            f"{number_text(rain, '.1%')} of the points are rain, {number_text(unknown, '.1%')} are "
            "not known."
        )
        if self.agreement.points:
            iou, removed = self.agreement.agreement.iou, self.agreement.removed
            text += (
                f" On held-out scans {self.student} agrees with it to an IoU of "
                f"{number_text(iou)}, and removes {number_text(removed, '.1%')} of the points."
            )
        first = next(doubts(self), None)
        return text if first is None else f"{text}\nNote: {first}"


def write_report(results: LearnResults) -> None:
    """Writes the report.

    Raises:
        InputError: An output that cannot be written.
    """
    write_text(results.path, as_markdown(results))


def as_markdown(results: LearnResults) -> str:
    """The text of the report."""
    parts = [
        f"# Learning from {results.title}",
        str(results),
        f"{results.trained_on:,} scans to learn from, {results.held_out:,} held out: these choose "
        "the best epoch and measure the student, which does not learn from them. No labels by "
        "people are read for any of this.",
        "## Limits of the model",
        "\n".join([*(f"- {doubt}" for doubt in doubts(results)), ALWAYS]),
    ]
    parts += [
        f"## The teacher: {results.teacher}",
        _table(("not rain", "rain", "not known"), results.taught, _teacher_cells),
    ]
    if results.persistence is not None:
        header = ("rain to persistence", "not known to it", "rain to the teacher")
        parts += [BESIDE_PERSISTENCE, _table(header, results.persistence, _persistence_cells)]
    if results.agreement.points:
        parts += [
            f"## The student: {results.student}",
            AGREEMENT_EXPLAINED,
            _table(("removed", "P", "R", "IoU"), results.agreement, _student_cells),
        ]
        pictures = results.pictures.items()
        parts += ["## Held-out scans", *(f"![{shows}]({path.name})" for path, shows in pictures)]
    parts += ["## How it was made", "\n".join(f"    {step}" for step in results.commands)]
    return "\n\n".join(parts) + "\n"


def doubts(results: LearnResults) -> Iterator[str]:
    """Reasons for caution before trusting the model, a sentence or two each."""
    taught = results.taught
    known = 1 - taught.shares[2]
    if taught.rain_among_known < LEAST_RAIN:
        yield (
            f"Hardly any rain was found ({taught.rain_among_known:.2%} of the points that the "
            "teacher is sure of): this recording seems to be clean, and nothing can be learnt from "
            "a clean one."
        )
    elif taught.rain_among_known < DOUBTFUL_RAIN:
        yield (
            f"Little rain was found ({taught.rain_among_known:.2%} of the points that the teacher "
            "is sure of): in dry air, leaves and boughs alone may be labelled as much. Check the "
            "removed points in the pictures."
        )
    if results.trained_on < ENOUGH_SCANS:
        yield (
            f"{results.trained_on} scans to learn from are few: they show one place, and the "
            "student may recognise its solid things by their place alone."
        )
    if known < ENOUGH_KNOWN:
        yield (
            f"The teacher is sure of {known:.0%} of the points only: too few scans around each, "
            "wrong poses, or a sensor whose scan pattern changes from scan to scan."
        )
    yield from _doubts_of_teacher(results)
    if results.stood:
        yield (
            "The sensor was at rest: all scans show one place. Drive a little, or record in "
            "several places, if the model is to be used while driving."
        )
    yield from _doubts_of_student(results)
    for warning in results.warnings:
        yield f"The recording is unusual: {warning}"


def _doubts_of_teacher(results: LearnResults) -> Iterator[str]:
    """Doubts that persistence raises about another teacher."""
    if results.persistence is None:
        return
    known = 1 - results.persistence.shares[2]
    if known < ENOUGH_KNOWN:
        yield (
            f"Persistence, the comparison for the teacher, is sure of only {known:.0%} of the "
            "points: it cannot confirm most of the teacher's labels."
        )
    for name, band in results.persistence.by_range.items():
        rain = band.shares[1]
        if rain > max(MORE_THAN_TAUGHT * band.removed, band.removed + MORE_BY):
            yield (
                f"At {name} persistence is sure that {rain:.1%} of the points are rain, and the "
                f"teacher labels {band.removed:.1%} as rain: it may miss this rain. Compare with "
                "`--teacher persistence`."
            )


def _doubts_of_student(results: LearnResults) -> Iterator[str]:
    """Doubts that the held-out scans raise."""
    if not results.agreement.points:
        return
    agreement = results.agreement
    rain = agreement.agreement.true_positive + agreement.agreement.false_negative
    if rain < ENOUGH_RAIN:
        yield (
            f"The teacher found {rain:,} points of rain in the held-out scans: too few to measure "
            "the agreement well."
        )
    if agreement.agreement.iou < ENOUGH_AGREEMENT:
        yield (
            "On held-out scans the student agrees with the teacher to an IoU of "
            f"{agreement.agreement.iou:.2f} only: one of the two is often wrong. Look at the "
            "pictures."
        )
    for name, band in agreement.by_range.items():
        _, rain_share, unknown = band.shares
        perhaps = rain_share + unknown
        if band.removed > max(MORE_THAN_TAUGHT * perhaps, perhaps + MORE_BY):
            yield (
                f"At {name} it removes {band.removed:.1%} of the points, of which the teacher "
                f"labels {rain_share:.1%} rain and {unknown:.1%} not known."
            )
    if results.sees_intensity:
        yield (
            "The student sees intensity in the unit of this recording: for a sensor of another "
            "unit, learn again, or with --blind."
        )


def _table(
    header: Sequence[str], answers: Answers, cells: Callable[[Answers], Iterable[str]]
) -> str:
    """A table with a row for all points, and one for each band of range that has points."""
    bands = {"all": answers, **answers.by_range}
    rows = [[name, f"{band.points:,}", *cells(band)] for name, band in bands.items() if band.points]
    return markdown_table(("range", "points", *header), rows)


def _teacher_cells(band: Answers) -> Iterable[str]:
    return [f"{share:.1%}" for share in band.shares]


def _persistence_cells(band: Answers) -> Iterable[str]:
    return [f"{share:.1%}" for share in (*band.shares[1:], band.removed)]


def _student_cells(band: Answers) -> Iterable[str]:
    counts = band.agreement
    scores = map(number_text, (counts.precision, counts.recall, counts.iou))
    return f"{band.removed:.1%}", *scores
