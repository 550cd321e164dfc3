"""``derain teach``: labels recordings by a method, for a network to learn from."""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from derain.bags.names import within
from derain.cards.card import DataCard, load_card, packaged_cards
from derain.cards.known import layouts_for
from derain.cli.arguments import add_threads
from derain.cli.bag_options import add_topic
from derain.cli.method_options import add_method, add_parameters, method_of
from derain.cli.outputs import say, tell
from derain.cli.pose_options import add_poses, placed
from derain.cli.runtime_options import add_runtime, runtime_of
from derain.cli.scan_by_scan import ScanByScan, exit_code
from derain.cli.scan_options import add_columns, add_intensity_scale
from derain.errors import InputError, printable
from derain.evaluation.counts import or_none
from derain.evaluation.text_tables import number_text
from derain.sources.folders import named_frames
from derain.sources.recordings import irregularities
from derain.system.memory import keep_freed_memory
from derain.system.notices import Notices, warn
from derain.views.oddities import much_removed

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from derain.sources.judging import Answer
    from derain.sources.method import Method
    from derain.sources.source import Source
    from derain.teaching.manifest import Manifest

DESCRIPTION = """\
Labels recordings by a method, to train a network: 0 is not rain, 1 rain, and 255 not known.
Training and measuring leave out points that are not known.

  derain teach persistence drive/ --out taught
  derain teach persistence drive/ --out taught --poses poses.txt
  derain teach crf drive/ other_drive/ --out taught
  derain teach default drive/ --out taught
  derain teach persistence WADS/sequences/36 --out taught --card wads
  derain fit --config outdet_taught.yaml --data.root taught

METHOD is a method that sees several scans, a filter, the model that comes with derain (below), a
model of your own (.onnx), or parameters from `derain tune` (.yaml). derain writes the labels, their
data card and a list of the scans; the scans stay in their place. The last fifth of each sequence is
the validation part. Scans without any known point are left out.
With --card, the meaning of the scans' own labels, derain also compares its labels with these, for
the record only: they do not change the result.
"""


@dataclass(frozen=True)
class TaughtFacts:
    """What was said of one scan.

    Attributes:
        scan: Its file.
        points: Its points that can be judged.
        rain: Share of them called rain; None, as for those below, where there are no such points.
        not_rain: Share of them called something else.
        not_known: Share of them of which it is not known.
        milliseconds: By stage.
    """

    scan: str
    points: int
    rain: float | None
    not_rain: float | None
    not_known: float | None
    milliseconds: dict[str, float]

    def __str__(self) -> str:
        return (
            f"{printable(self.scan)}: {self.points:,} valid points, "
            f"{number_text(self.rain, '.1%')} rain, {number_text(self.not_rain, '.1%')} not rain, "
            f"{number_text(self.not_known, '.1%')} not known, "
            f"{sum(self.milliseconds.values()):.0f} ms"
        )


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    add_method(parser)
    parser.add_argument(
        "scans", nargs="+", type=Path, help="folders of consecutive scans, or a data set's folder"
    )
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument(
        "--card",
        help="data card of the scans' own labels, to compare with for the record: "
        f"{', '.join(packaged_cards())}, or a YAML file",
    )
    add_threads(parser)
    add_runtime(parser, help="what runs a model")
    parser.add_argument("--json", action="store_true", help="print one JSON object per scan")
    add_columns(parser)
    add_topic(parser)
    add_intensity_scale(parser)
    add_parameters(parser)
    add_poses(parser)


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    from derain.teaching.teach import refuse_to_overwrite, teach

    keep_freed_memory()
    runtime = runtime_of(arguments.runtime, arguments.precision)
    settings = dict(arguments.set)
    method = method_of(arguments.method, arguments.parameters, settings, arguments.threads, runtime)
    card = None if arguments.card is None else load_card(arguments.card)
    found = named_frames(
        within(arguments.scans, arguments.topic),
        arguments.columns,
        labelled=True,
        layouts=layouts_for(card),
        recordings=True,
    )
    refuse_to_overwrite(arguments.out, found)
    source = placed(found, arguments.poses, arguments.threads).map(
        lambda frame: frame.with_intensity_times(arguments.intensity_scale)
    )
    for sentence in irregularities(source, method.window):
        warn(sentence)
    scans = ScanByScan(source)
    telling = _Telling(method, source, card, arguments.json)
    manifest = teach(method, source, arguments.out, card, scans.passing_over, telling.watch)
    telling.tell_all(manifest)
    failed = len(scans.errors)
    return exit_code(failed, len(source), "{scans} could not be judged, and have no labels")


class _Telling:
    """Tells of each scan what was said of it, and of all of them at the end."""

    def __init__(
        self, method: "Method", source: "Source", card: DataCard | None, as_json: bool
    ) -> None:
        from derain.teaching.shares import TaughtShares

        self.method = method
        self.frames = {frame.key: frame for frame in source}
        self.judged = 0
        self.as_json = as_json
        self.shares = TaughtShares()
        self.notices = Notices()
        self.record = None
        if card is not None and any(frame.has_labels for frame in source):
            from derain.teaching.truth import TruthRecord

            self.record = TruthRecord(card)

    def watch(self, answer: "Answer", labels: "NDArray[np.uint32]") -> None:
        """Tells of one scan, as it is judged."""
        frame, judgement, stopwatch = answer
        self.judged += 1
        odd = [*self.method.oddities(judgement), *much_removed(judgement.share_of_rain)]
        self.notices.tell(frame.name, odd)
        not_rain, rain, unknown = map(or_none, self.shares.add(judgement.scan, labels).tolist())
        points = int(judgement.scan.valid.sum())
        times = dict(stopwatch.milliseconds)
        tell(TaughtFacts(frame.name, points, rain, not_rain, unknown, times), self.as_json)
        if self.record is not None:
            try:
                self.record.add(self.frames[frame.key], judgement)
            except InputError as error:
                warn(f"not measured: {error}")

    def tell_all(self, manifest: "Manifest") -> None:
        """Tells of all scans, and of what a student could not do with them."""
        from derain.teaching.manifest import HELD_OUT_PART

        stream = sys.stderr if self.as_json else sys.stdout
        self.notices.tell_how_many_more()
        say(f"{self.judged:,} scans\n{self.shares}", stream)
        if self.record is not None and self.record.scans:
            say(
                f"for the record only, beside {self.record.card.title}'s own labels of "
                f"{self.record.scans:,} scans, which changed nothing:\n{self.record}",
                stream,
            )
        if nothing := self.judged - len(manifest.scans):
            warn(f"{nothing:,} of {self.judged:,} scans are left out: of them nothing is known")
        if not self.shares.rain:
            warn("no rain was found: a network would learn that nothing is rain")
        if not any(scan.part == HELD_OUT_PART for scan in manifest.scans):
            warn("no scan is held out, for that a sequence needs three: all are for training")
