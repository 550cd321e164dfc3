"""The labelled scans of a table's columns, simulated where they are to be."""

import shlex
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.sensor_table.plan import LabelledData
from benchmarks.sensor_table.rows import require
from derain.cli.main import main as derain
from derain.datamodules.base import Loading, Part
from derain.datamodules.labelled import card_of, labelled_scans
from derain.errors import InputError
from derain.export.bench.labelled_frames import LabelledFrames


@dataclass
class DataFinder:
    """Finds scans, and makes those that are to be simulated.

    Attributes:
        shared: Folder that the others are found below.
        simulated: Folder that simulated data sets lie in, each named by the options that make it.
    """

    shared: Path
    simulated: Path
    _complete: set[Path] = field(default_factory=set)

    def measured(self, data: LabelledData) -> LabelledFrames:
        """The scans that are measured: of a data set its test part.

        Of one without rain, where nobody learns anything, every part.

        Raises:
            InputError: They are not there, or cannot be simulated.
        """
        parts: Sequence[Part] = ("train", "validation", "test") if data.taken else ("test",)
        return self._found(data, parts)

    def of_places(self, data: LabelledData) -> LabelledFrames:
        """Other scans of the same data, from which places can be learnt.

        Raises:
            InputError: There are none, or they are not there.
        """
        if data.position:
            return self._found(LabelledData(data.position, card=data.card), ("train",))
        if data.simulate:
            return self._found(data, ("train",))
        raise InputError(
            ", ".join(data.scans), "there are no others to learn places from", "Name some."
        )

    def _found(self, data: LabelledData, parts: Sequence[Part]) -> LabelledFrames:
        if data.simulate:
            paths = [self._made(data.simulate)]
        else:
            paths = [require(self.shared / scans) for scans in data.scans]
        found = labelled_scans(paths, card_of(paths, data.card), Loading())
        frames = [frame for part in parts for frame in found.frames(part)]
        return LabelledFrames(found.card, frames, distinct=found.distinct)

    def _made(self, options: str) -> Path:
        """The folder of a simulated data set, which is taken as it is where it is complete."""
        words = options.replace("--", "").replace("/", "_").split()
        folder = self.simulated / "-".join(words)
        if folder not in self._complete:
            with redirect_stdout(sys.stderr):  # the table goes to the other
                if derain(["simulate", "--out", str(folder), *shlex.split(options)]):
                    raise InputError(folder, "could not be simulated", "See above.")
            self._complete.add(folder)
        return folder
