"""Scans and labels picked by patterns."""

from glob import glob
from pathlib import Path

from derain.cards.card import load_card
from derain.datamodules.base import Loading, Part, ScanDataModule
from derain.errors import InputError
from derain.files.labels import label_beside
from derain.sources.folders import frames_of, relative_keys
from derain.sources.source import Source


class Folder(ScanDataModule):
    """Scans picked by patterns; a scan's labels are ``<stem>.label`` beside it or in ``../labels``.

    Example:
        >>> data = Folder(".", card="wads", train=["*.bin"])
        >>> [frame.path.name for frame in data.frames("train")]
        ['scan.bin']

    Args:
        root: Folder that the patterns start from.
        card: Name of a packaged data card, or a YAML file: it maps label ids to class names and
            names those of rain.
        train: Patterns of the training scans, such as ``velodyne/*.bin`` or ``**/*.pcd``.
        validation: Patterns of the validation scans.
        test: Patterns of the scans for test and prediction.
        loading: Options for reading and batching scans.
    """

    def __init__(
        self,
        root: str,
        card: str,
        train: list[str] = [],
        validation: list[str] = [],
        test: list[str] = [],
        loading: Loading = Loading(),
    ) -> None:
        super().__init__(load_card(card), loading)
        self.root = Path(root)
        self.patterns = {"train": train, "validation": validation, "test": test, "predict": test}

    def source(self, part: Part) -> Source:
        """The scans that match a part's patterns, sorted within each pattern.

        Raises:
            InputError: A pattern without a match.
        """
        patterns = self.patterns[part]
        if not patterns:
            raise InputError(self.root, f"no patterns for {part}", f"Give --data.{part}.")
        scans = [scan for pattern in patterns for scan in self._matches(pattern)]
        return frames_of(scans, label_beside, self.loading.columns, relative_keys(scans))

    def _matches(self, pattern: str) -> list[Path]:
        found = sorted(glob(pattern, root_dir=self.root, recursive=True))
        paths = [self.root / path for path in found if not path.endswith(".label")]
        matches = [path for path in paths if not path.is_dir()]
        if not matches:
            remedy = "Check root and pattern, such as velodyne/*.bin."
            raise InputError(self.root / pattern, "matches no scan", remedy)
        return matches
