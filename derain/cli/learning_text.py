"""What is said of a derainer that a teacher has taught: how far to trust it, and when not to."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from derain.evaluation.answers import Answers, AnswersOfScan, coarse_bands, total
from derain.evaluation.counts import Counts
from derain.evaluation.text_tables import markdown_table, number_text

# Shares of the points that a teacher is sure of. Less than a thousandth of a scan is what a few
# moving things make of clean air. Of simulated dry streets persistence calls up to .7 % rain, the
# leaves and boughs (BENCHMARK.md): so little is believed, but not without a word.
LEAST_RAIN = 0.001
DOUBTFUL_RAIN = 0.01

# From where on a report does not raise a doubt. They choose nothing: they are what a reader is told
# to look at.
ENOUGH_SCANS = 10
ENOUGH_KNOWN = 0.7
ENOUGH_AGREEMENT = 0.7
ENOUGH_RAIN = 1000
MORE_THAN_TAUGHT = 1.5
MORE_BY = 0.005

ALWAYS = """\
- The held-out scans are of the same drive as those it learnt from. Of another sensor, another
  mounting, heavier rain or another kind of it, they say nothing.
- Agreement is not truth: where the teacher errs in the same way again and again, such as on cars
  that move as it does, the student learns that, and the agreement does not show it. The pictures
  do: look for red and blue on things.
- Run it on a recording in dry air, and see that it removes nothing: `derain run`, and the share it
  prints."""

AGREEMENT_EXPLAINED = """\
P, R and IoU compare the student with the teacher as if that were the truth, on the points of
held-out scans that the teacher is sure of. A student can be better than its teacher: what the
teacher gets wrong here and there, but right on the whole, it does not learn."""


@dataclass
class Learnt:
    """What is known of a lesson, as far as it has come.

    Attributes:
        title: What it learnt from.
        teacher: Name of the teacher.
        student: Name of the network, and what it sees.
        scans: What the teacher says, scan by scan in time order.
        asked: What the student says beside that, of held-out scans; none before it has learnt.
        stood: Whether the sensor was said to stand.
        sees_intensity: Whether the student does.
        warned: What the commands warned of.
        pictures: What they show, by file in the folder of the report.
        record: Scores by labels, where a user asked for them; they chose nothing.
        steps: The commands.
    """

    title: str
    teacher: str
    student: str
    scans: Sequence[AnswersOfScan]
    asked: Sequence[AnswersOfScan] = ()
    stood: bool = False
    sees_intensity: bool = True
    warned: Sequence[str] = ()
    pictures: dict[Path, str] = field(default_factory=dict)
    record: str = ""
    steps: Sequence[str] = ()

    @property
    def taught(self) -> Answers:
        """What the teacher says of all scans."""
        return total([scan.answers for scan in self.scans])

    @property
    def student_says(self) -> Answers:
        """What the student says of the held-out scans, beside the teacher."""
        return total([scan.answers for scan in self.asked])

    @property
    def learnt_from(self) -> int:
        """Scans that the student learnt from."""
        return sum(not scan.held_out for scan in self.scans)


def as_markdown(learnt: Learnt) -> str:
    """The report."""
    parts = [f"# What was learnt from {learnt.title}", _in_short(learnt)]
    parts += ["## What could not be learnt, and when not to trust it", _doubts_text(learnt)]
    parts += [f"## The teacher: {learnt.teacher}", _teacher_table(learnt.taught)]
    parts += _pictures(learnt.pictures, "teacher")
    if learnt.asked:
        parts += [
            f"## The student: {learnt.student}",
            AGREEMENT_EXPLAINED,
            _student_table(learnt.student_says),
        ]
        parts += _pictures(learnt.pictures, "removed")
        parts += ["## Held-out scans", *_pictures(learnt.pictures, "held_out")]
    if learnt.record:
        parts += ["## Beside the labels, for the record", learnt.record]
    parts += ["## How it was made", "\n".join(f"    {step}" for step in learnt.steps)]
    return "\n\n".join(parts) + "\n"


def summary(learnt: Learnt) -> str:
    """Two or three sentences for the screen."""
    _, rain, unknown = learnt.taught.shares
    text = (
        f"{learnt.teacher} says of {len(learnt.scans):,} scans: {number_text(rain, '.1%')} of the "
        f"points are rain, of {number_text(unknown, '.1%')} it does not know."
    )
    if learnt.asked:
        agreement, removed = learnt.student_says.agreement, learnt.student_says.removed
        text += (
            f" {learnt.student} agrees with it on held-out scans to an IoU of "
            f"{number_text(agreement.iou)}, "
            f"and removes {number_text(removed, '.1%')} of their points."
        )
    first = next(doubts(learnt), None)
    return text if first is None else f"{text}\nMind: {first}"


def doubts(learnt: Learnt) -> Iterator[str]:
    """What a reader should know before trusting the model, a sentence or two each."""
    taught = learnt.taught
    known = 1 - taught.shares[2]
    if taught.rain_among_known < LEAST_RAIN:
        yield (
            f"Hardly any rain was found ({taught.rain_among_known:.2%} of what the teacher is sure "
            "of): this recording seems to be clean, and a clean one teaches nothing."
        )
    elif taught.rain_among_known < DOUBTFUL_RAIN:
        yield (
            f"Little rain was found ({taught.rain_among_known:.2%} of what the teacher is sure "
            "of): leaves and boughs alone may come to as much in dry air. See in the pictures what "
            "is removed."
        )
    if learnt.learnt_from < ENOUGH_SCANS:
        yield (
            f"{learnt.learnt_from} scans to learn from are few: they show one place, and what of "
            "it is not rain may be known by its place alone."
        )
    if known < ENOUGH_KNOWN:
        yield (
            f"The teacher is sure of {known:.0%} of the points only: too few scans around each, "
            "poses that are wrong, or a sensor of another scan pattern in every scan."
        )
    if learnt.stood:
        yield (
            "The sensor stood: all scans show one place. Drive a little, or record in several "
            "places, if it is to be used while driving."
        )
    yield from _doubts_of_student(learnt)
    if learnt.warned:
        more = f" (and {len(learnt.warned) - 1} more in log.txt)" if len(learnt.warned) > 1 else ""
        yield f"Something was odd about the recording: {learnt.warned[0]}{more}"


def _doubts_of_student(learnt: Learnt) -> Iterator[str]:
    """What only held-out scans tell."""
    if not learnt.asked:
        return
    says = learnt.student_says
    rain = says.agreement.true_positive + says.agreement.false_negative
    if rain < ENOUGH_RAIN:
        yield (
            f"The teacher found {rain:,} points of rain in the held-out scans: too few for the "
            "agreement to say much."
        )
    if says.agreement.iou < ENOUGH_AGREEMENT:
        yield (
            f"On held-out scans the student agrees with the teacher to an IoU of "
            f"{says.agreement.iou:.2f} only: one of the two is often wrong. Look at the pictures."
        )
    for name, band in coarse_bands(says).items():
        _, rain_share, unknown = band.shares
        perhaps = rain_share + unknown
        if band.removed > max(MORE_THAN_TAUGHT * perhaps, perhaps + MORE_BY):
            yield (
                f"At {name} it removes {band.removed:.1%} of the points, where the teacher saw "
                f"{rain_share:.1%} of rain and did not know of {unknown:.1%}."
            )
    if learnt.sees_intensity:
        yield (
            "It sees intensity in the unit of this recording: for a sensor of another unit, learn "
            "anew or with --blind."
        )


def _in_short(learnt: Learnt) -> str:
    held_out = len(learnt.scans) - learnt.learnt_from
    return (
        f"{summary(learnt)}\n\n{learnt.learnt_from:,} scans to learn from, {held_out:,} held out: "
        "the student was chosen and asked by those, and did not learn from them. No label of a "
        "person was read for any of this."
    )


def _doubts_text(learnt: Learnt) -> str:
    return "\n".join([*(f"- {doubt}" for doubt in doubts(learnt)), ALWAYS])


def _teacher_table(answers: Answers) -> str:
    rows = [
        [name, f"{band.points:,}", *(f"{share:.1%}" for share in band.shares)]
        for name, band in {"all": answers, **coarse_bands(answers)}.items()
        if band.points
    ]
    return markdown_table(("range", "points", "not rain", "rain", "not known"), rows)


def _student_table(answers: Answers) -> str:
    rows = [
        [name, f"{band.points:,}", f"{band.removed:.1%}", *_scores(band.agreement)]
        for name, band in {"all": answers, **coarse_bands(answers)}.items()
        if band.points
    ]
    return markdown_table(("range", "points", "removed", "P", "R", "IoU"), rows)


def _scores(counts: Counts) -> list[str]:
    return [number_text(score) for score in (counts.precision, counts.recall, counts.iou)]


def _pictures(pictures: Mapping[Path, str], beginning: str) -> list[str]:
    return [
        f"![{what}]({path.name})"
        for path, what in pictures.items()
        if path.name.startswith(beginning)
    ]
