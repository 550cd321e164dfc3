"""The network published for REHEARSE-3D as an observer of the simulated facility.

The data are not available, but the network was trained on them. It is run unchanged, with the
statistics of WADS, which its weights fit best (derain/cards/rehearse3d.yaml):

derain simulate --out facility --sequences 25 --scans 2
python -m benchmarks.facility_observer outdet_rehearse3d.pt facility

Prints four tables: the training intensities recovered from its BatchNorm layer, beside those of the
facility; its scores beside the rules of intensity and of position, fitted to the facility's
training scans; the points that it calls rain if every point has one intensity; and how well a rule
of intensity alone predicts its answers if intensities are unrelated to rain.
"""

import argparse
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch

from benchmarks.batchnorm_memory import remembered_intensity
from derain.cards.card import load_card
from derain.datamodules.simulated import Simulated
from derain.errors import InputError
from derain.evaluation.baselines import IntensityRule, PositionPrior, all_points
from derain.evaluation.contents import find_sequences
from derain.evaluation.counts import Counts
from derain.evaluation.text_tables import markdown_table, number_text
from derain.files import read_scan
from derain.models.outdet import OutDet
from derain.models.published import read_state_dict
from derain.scan import Bools, Float32s, Floats, Scan
from derain.views.probability import probability_of_rain

Method = Callable[[Scan], Bools]

CARD = load_card("simulated")

# Intensities that all points are given, one after another.
CONSTANT = (0.0, 5.0, 10.0, 12.0, 13.0, 14.0, 20.0, 30.0)

# Where intensities are drawn anew, all points of a cube have one, from the span, logarithmically.
CUBE = 1.0
DRAWN = (2.0, 100.0)


class Example(NamedTuple):
    """A test scan: LiDAR and radar, how many of its rows are LiDAR's, its rain and its rate."""

    scan: Scan
    lidar_points: int
    rain: Bools
    rate: float


def published_network(weights: Path) -> Method:
    """The published network as a function of a scan: True for the points that it calls rain.

    Raises:
        InputError: No such weights, or those of another network.
    """
    if not weights.is_file():
        reason = "the weights published for REHEARSE-3D are not there"
        raise InputError(weights, reason, "Fetch them from the data set's project page.")
    card = load_card("rehearse3d").normalised_as(load_card("wads"))
    model = OutDet.from_published(read_state_dict(weights), card).eval()
    view = model.spec.make_view()

    def judge(scan: Scan) -> Bools:
        seen = view(scan)
        with torch.inference_mode():
            logits = model(**{name: torch.from_numpy(a) for name, a in seen.inputs().items()})
        rain: Bools = seen.back(probability_of_rain(logits.numpy())) > 0.5
        return rain

    return judge


def main() -> None:
    """Prints the four tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("weights", type=Path, help="3D-OutDet as published for REHEARSE-3D")
    parser.add_argument("root", type=Path, help="a facility that `derain simulate` made")
    arguments = parser.parse_args()
    network = published_network(arguments.weights)
    data = Simulated(str(arguments.root), make=False)
    examples = list(_examples(data, arguments.root))
    print(_intensities(arguments.weights, examples), end="\n\n", flush=True)
    methods: dict[str, Method] = {
        "published 3D-OutDet": network,
        "intensity": IntensityRule.best(_truths(data)),
        "position": PositionPrior.learn(_truths(data)),
        "all": all_points,
    }
    print(_scores(methods, examples), end="\n\n", flush=True)
    wet = [example for example in examples if example.rate]
    one_of_each = {example.rate: example for example in wet}.values()
    print(_at_constant_intensities(network, one_of_each), end="\n\n", flush=True)
    print(_as_a_rule(network, wet))


def _examples(data: Simulated, root: Path) -> Iterator[Example]:
    sequences = find_sequences(root, CARD.layout)
    rates = {frames[0].sequence: rate or 0.0 for frames, rate in sequences}
    for frame in data.frames("test"):
        scan = data.reader.read(frame)
        alone = Path(frame.name.replace(CARD.layout.scans, CARD.layout.lidar))
        yield Example(scan, len(read_scan(alone)), CARD.rain_of(scan), rates[frame.sequence])


def _truths(data: Simulated) -> Iterator[tuple[Scan, Bools]]:
    for frame in data.frames("train"):
        scan = data.reader.read(frame)
        yield scan, CARD.rain_of(scan)


def _intensity(scan: Scan) -> Float32s:
    assert scan.intensity is not None
    return scan.intensity


def _intensities(weights: Path, examples: Sequence[Example]) -> str:
    """Mean and spread of intensities, of training by the network and of the facility."""
    mean, deviation = remembered_intensity(read_state_dict(weights), load_card("wads"))
    ours = np.concatenate([_intensity(each.scan) for each in examples])
    drops, others = (
        np.concatenate(
            [
                _intensity(each.scan)[: each.lidar_points][(each.rain == wet)[: each.lidar_points]]
                for each in examples
            ]
        )
        for wet in (True, False)
    )
    of_drops, of_others = np.percentile(drops, [50, 99]), np.percentile(others, [1, 5, 50])
    return markdown_table(
        ["intensities", "mean", "standard deviation", "drops 50, 99 %", "others 1, 5, 50 %"],
        [
            ["REHEARSE-3D, as the network has it", f"{mean:.1f}", f"{deviation:.1f}", "", ""],
            [
                "facility",
                f"{ours.mean():.1f}",
                f"{ours.std():.1f}",
                ", ".join(f"{value:.1f}" for value in of_drops),
                ", ".join(f"{value:.1f}" for value in of_others),
            ],
        ],
    )


def _scores(methods: Mapping[str, Method], examples: Sequence[Example]) -> str:
    """Precision, recall and IoU with the radar, IoU by rain rate and without the radar."""
    rates = sorted({each.rate for each in examples if each.rate})
    head = ["method", "P", "R", "IoU", *(f"{rate:g} mm/h" for rate in rates), "LiDAR alone"]
    body = []
    for name, method in methods.items():
        fused, alone = Counts(), Counts()
        of_rate = dict.fromkeys(rates, Counts())
        for scan, lidar_points, rain, rate in examples:
            counts = Counts.of(method(scan), rain)
            fused += counts
            if rate:
                of_rate[rate] += counts
            lidar = np.arange(lidar_points)
            alone += Counts.of(method(scan.take(lidar)), rain[lidar])
        values = fused.precision, fused.recall, fused.iou, *(each.iou for each in of_rate.values())
        body.append([name, *map(number_text, (*values, alone.iou))])
    rule = methods["intensity"]
    assert isinstance(rule, IntensityRule)
    learnt = f"intensity: at most {rule.intensity:.1f}, and not beyond {rule.range:.1f} m"
    return f"{markdown_table(head, body)}\n\n{learnt}"


def _at_constant_intensities(network: Method, examples: Iterable[Example]) -> str:
    """Share of the rain and of the rest that is called rain if all points have one intensity."""
    body = []
    for intensity in CONSTANT:
        counts = Counts()
        for scan, _, rain, _ in examples:
            # Intensities that are all the same count as not measured.
            constant = intensity + 0.01 * (np.arange(len(scan)) % 2)
            counts += Counts.of(network(_with(scan, constant)), rain)
        rest = counts.false_positive + counts.true_negative
        body.append(
            [f"{intensity:g}", f"{counts.recall:.2f}", f"{counts.false_positive / rest:.2f}"]
        )
    return markdown_table(["every intensity", "of the rain", "of the rest"], body)


def _as_a_rule(network: Method, examples: Sequence[Example]) -> str:
    """Agreement of a limit of intensity, fitted to the network's rain, with the network."""
    generator = np.random.default_rng(0)
    drawn = [(_drawn_anew(scan, generator), rain) for scan, _, rain, _ in examples]
    called = [(scan, network(scan)) for scan, _ in drawn]
    half = len(called) // 2
    rule = replace(IntensityRule.best(called[:half]), range=np.inf)
    agreement = _summed(Counts.of(rule(scan), answer) for scan, answer in called[half:])
    truth = _summed(
        Counts.of(answer, rain)
        for (_, answer), (_, rain) in zip(called[half:], drawn[half:], strict=True)
    )
    alike = agreement.true_positive + agreement.true_negative
    points = alike + agreement.false_positive + agreement.false_negative
    return markdown_table(
        ["intensities drawn anew", "IoU", "points alike"],
        [
            [
                f"network, and intensity <= {rule.intensity:.1f}",
                f"{agreement.iou:.3f}",
                f"{alike / points:.3f}",
            ],
            ["network, and what is rain", f"{truth.iou:.3f}", ""],
        ],
    )


def _drawn_anew(scan: Scan, generator: np.random.Generator) -> Scan:
    """The scan with an intensity for each cube of space, whatever is in it."""
    _, cube = np.unique(np.floor(scan.xyz / CUBE), axis=0, return_inverse=True)
    values = np.exp(generator.uniform(*np.log(DRAWN), cube.max() + 1))
    return _with(scan, values[cube.ravel()])


def _with(scan: Scan, intensity: Floats) -> Scan:
    return replace(scan, intensity=intensity.astype(np.float32))


def _summed(counts: Iterable[Counts]) -> Counts:
    return sum(counts, Counts())


if __name__ == "__main__":
    main()
