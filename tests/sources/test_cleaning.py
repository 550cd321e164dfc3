"""``derain.clean``: what it writes, and what it reports of each scan and of all of them."""

from pathlib import Path

import numpy as np
import pytest

import derain
from derain.evaluation.hard_cases import scene
from derain.files.labels import read_labels
from derain.sources.cleaned_scan import ScanOutcome
from derain.sources.cleaning import CleaningObserver
from derain.sources.judgement import Judgement
from derain.sources.weather_monitor import WeatherOptions

DROR = derain.FilterDerainer(derain.DROR())


class Recorder(CleaningObserver):
    """Records what it is called for."""

    def __init__(self) -> None:
        self.calls: list[tuple[str, str]] = []

    def judged(self, judgement: Judgement) -> None:
        self.calls.append(("judged", Path(judgement.scan.name).name))

    def cleaned(self, outcome: ScanOutcome) -> None:
        self.calls.append(("cleaned", Path(outcome.frame.name).name))

    def failed(self, error: derain.InputError) -> None:
        self.calls.append(("failed", Path(str(error.subject)).name))


@pytest.fixture
def scans(tmp_path) -> Path:
    """Two scans, and between them a file that is none."""
    for number in (0, 2):
        scene(200, seed=number).tofile(tmp_path / f"{number}.bin")
    (tmp_path / "1.bin").write_bytes(b"broken")
    return tmp_path


def test_a_scan_that_cannot_be_read_is_reported_and_the_others_are_cleaned(scans) -> None:
    recorder, out = Recorder(), scans / "out"
    report = derain.clean(scans, DROR, out, most_removed=1, observer=recorder)
    assert recorder.calls == [
        *[("judged", "0.bin"), ("cleaned", "0.bin"), ("failed", "1.bin")],
        *[("judged", "2.bin"), ("cleaned", "2.bin")],
    ]
    assert [Path(str(error.subject)).name for error in report.failures] == ["1.bin"]
    assert {path.name for path in out.iterdir()} == {"0.bin", "0.label", "2.bin", "2.label"}
    for scan in report.scans:
        path = Path(scan.scan)
        rain = read_labels(out / f"{path.stem}.label", scan.points)
        np.testing.assert_array_equal(rain, DROR(derain.read_scan(path)))
        assert (scan.rain, len(derain.read_scan(out / path.name))) == (rain.sum(), 200 - rain.sum())


def test_a_scan_with_too_much_rain_is_not_written(scans) -> None:
    report = derain.clean(scans / "0.bin", DROR, scans / "out", most_removed=0)
    assert (len(report.scans), len(report.failures)) == (0, 1)
    assert not (scans / "out").exists()


def test_the_weather_of_every_scan_is_measured_where_it_is_asked_for(scans) -> None:
    files = [scans / "0.bin", scans / "2.bin"]
    sampled, every = (
        derain.clean(files, DROR, scans / "out", most_removed=1, weather=WeatherOptions(asked))
        for asked in (False, True)
    )
    assert [scan.weather for scan in sampled.scans] == [None, None]
    assert all(scan.weather.rays > 0 for scan in every.scans)
    assert every.weather.total.rays == sampled.weather.total.rays
    assert every.weather.scans_at.total() == 2
