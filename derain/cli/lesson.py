"""What ``derain learn`` is asked to learn, and from what."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from derain.files import DEFAULT_COLUMNS
from derain.odometry.posed import ODOMETRY
from derain.sources.source import Source

PERSISTENCE = "persistence"


@dataclass(frozen=True)
class Lesson:
    """What is learnt from what.

    Attributes:
        recordings: Folders of consecutive scans.
        out: The ONNX file.
        work: Folder of all else that is written.
        model: Name of the network; None for that of the start, and for 3D-OutDet without one.
        teacher: Name of the teacher, or the file of a model.
        poses: Where the sensor was, as ``--poses`` says it; None for what lies beside the scans,
            and for odometry where nothing does.
        blind: Whether the network is not to see intensities.
        columns: Names of the columns of files that do not name them.
        epochs: Epochs of the training; None for those of the network's configuration.
        card: Data card of labels that measure the finished model; None measures nothing.
        rerun: Rerun file that shows teacher and student scan after scan; None writes none.
        start: The trained model whose weights the network begins with; None draws them at random.
    """

    recordings: Sequence[Path]
    out: Path
    work: Path
    model: str | None = None
    teacher: str = PERSISTENCE
    poses: str | None = None
    blind: bool = False
    columns: Sequence[str] = DEFAULT_COLUMNS
    epochs: int | None = None
    card: str | None = None
    start: str | None = None
    rerun: Path | None = None

    @property
    def student(self) -> str:
        """What a report calls it."""
        blind = ", blind to intensity" if self.blind else ""
        start = "" if self.start is None else f", started from {self.start}"
        return f"{self.model}{blind}{start}"

    @property
    def taught(self) -> Path:
        """Folder of the teacher's labels."""
        return self.work / "taught"

    @property
    def checkpoint(self) -> Path:
        """Checkpoint of the student, the best by its agreement with the teacher."""
        return self.work / "student.ckpt"

    def needs_odometry(self, source: Source) -> bool:
        """Whether the teacher asks where the sensor was, and nobody says so.

        Args:
            source: The scans.

        Raises:
            InputError: A record of poses that is damaged or does not fit the scans.
        """
        told = self.poses is not None or all(frame.pose is not None for frame in source)
        return self.teacher == PERSISTENCE and (self.poses == ODOMETRY or not told)
