"""What drawn sensors are drawn from, as a document states it."""

from pathlib import Path

import numpy as np
import pytest

from derain.errors import InputError
from derain.files.documents import Entry
from derain.simulation.spans import DefectSpans, SensorSpans, draw, draw_kind


def read(tmp_path: Path, content: str) -> SensorSpans:
    path = tmp_path / "spans.yaml"
    path.write_text(content)
    return SensorSpans.of(Entry.of_yaml(path))


def test_a_document_states_what_differs_from_the_defaults(tmp_path: Path) -> None:
    assert read(tmp_path, "{}") == SensorSpans()
    content = "kinds: {front: 1}\ntilt: [0, 1]\nfront_rows: [64]\ndefects: {dropped: [0, 0.1]}"
    assert read(tmp_path, content) == SensorSpans(
        kinds={"front": 1.0},
        tilt=(0, 1),
        front_rows=(64,),
        defects=DefectSpans(dropped=(0, 0.1)),
    )


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("tilt: [3, 1]", "tilt"),
        ("tilt: 3", "tilt"),
        ("tilt: [-1.0e+308, 1.0e+308]", "tilt"),
        ("minimum_range: [0, 1]", "minimum_range"),
        ("detection_threshold: [-1, 1]", "detection_threshold"),
        ("kinds: {round: 1}", "kinds"),
        ("kinds: {front: 0}", "kinds"),
        ("kinds: {front: -1, spinning: 2}", "kinds"),
        ("kinds: {}", "kinds"),
        ("returns: {first: 1}", "returns"),
        ("spinning_rows: []", "spinning_rows"),
        ("spinning_rows: [1]", "spinning_rows"),
        ("front_rows: [16.5]", "front_rows"),
        ("uneven: 1.5", "uneven"),
        ("most_beams: 0", "most_beams"),
        ("colour: [1, 2]", "colour"),
        ("defects: {none: 2}", "none"),
        ("defects: {dropped: [0.2, 0.1]}", "dropped"),
        ("defects: {rust: [0.2, 0.1]}", "rust"),
    ],
)
def test_what_is_impossible_is_refused_by_name(content: str, named: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=rf"spans\.yaml: .*{named}"):
        read(tmp_path, content)


def test_a_span_is_drawn_evenly_or_evenly_in_its_logarithm() -> None:
    spans, generator = SensorSpans(tilt=(1, 3), minimum_range=(0.1, 10)), np.random.default_rng(0)
    tilts = np.array([draw(spans, "tilt", generator) for _ in range(4000)])
    ranges = np.array([draw(spans, "minimum_range", generator) for _ in range(4000)])
    for sample, quartiles in ((tilts, (1.5, 2, 2.5)), (np.log10(ranges), (-0.5, 0, 0.5))):
        assert np.quantile(sample, (0.25, 0.5, 0.75)) == pytest.approx(quartiles, abs=0.06)
    assert tilts.min() >= 1
    assert tilts.max() <= 3


def test_kinds_come_by_their_weights() -> None:
    generator = np.random.default_rng(1)
    drawn = [draw_kind({"a": 3.0, "b": 1.0, "c": 0.0}, generator) for _ in range(4000)]
    assert drawn.count("a") == pytest.approx(3000, abs=4 * 27.4)
    assert drawn.count("c") == 0
