"""What holds for every filter: hard scans, copies, stages, and parameters that make no sense."""

import re
from dataclasses import make_dataclass, replace

import numpy as np
import pytest

from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.filters import CRF, DROR, DSOR, FILTERS, ROR, SOR, SSR, FilterDerainer, filter_from
from derain.scan import Scan
from derain.sources.frame import MemoryFrame
from derain.system.stopwatch import Stopwatch
from derain.views.candidates import Bound, Candidates

# With these, some points of a scene are rain and some are not.
PUBLISHED_CRF = CRF(variant="published", vote=0.1, intensity=60, range=60)
MIXED = [CRF(), PUBLISHED_CRF, ROR(radius=0.8), SOR(), DROR(), DSOR(), SSR(threshold=400)]
every_filter = pytest.mark.parametrize("filter_", MIXED, ids=str)


@every_filter
def test_a_hard_scan_gets_an_answer_for_every_row(filter_) -> None:
    few = {f"{points} points": Scan.of(scene()[:points]) for points in (0, 1, 4)}
    with np.errstate(all="raise", under="ignore"):
        for name, scan in {**dict(hard_cases(largest=50)), **few}.items():
            rain = FilterDerainer(filter_, threads=2)(scan)
            assert (rain.dtype, rain.shape) == (bool, (len(scan),)), name
            assert not rain[~scan.valid].any(), name


@every_filter
def test_neither_order_nor_copies_nor_threads_nor_the_way_of_asking_matter(filter_) -> None:
    derainer, points = FilterDerainer(filter_, threads=1), scene()
    rain = derainer(points)
    assert 0.01 < rain.mean() < 0.98
    shuffle = np.random.default_rng(0).permutation(len(points))
    np.testing.assert_array_equal(derainer(points[shuffle]), rain[shuffle])
    np.testing.assert_array_equal(derainer(np.repeat(points, 3, axis=0)), np.repeat(rain, 3))
    np.testing.assert_array_equal(FilterDerainer(filter_, threads=2)(points), rain)
    frame, stopwatch = MemoryFrame(key="0", scan=Scan.of(points)), Stopwatch()
    judgement = derainer.push(frame, stopwatch)
    assert list(stopwatch.milliseconds) == ["read", "view", "network", "back"]
    assert judgement.frame is frame
    np.testing.assert_array_equal(judgement.rain, rain)
    np.testing.assert_array_equal(judgement.probability, rain.astype(np.float32))
    np.testing.assert_array_equal(derainer.push(points).rain, rain)
    assert 0 < judgement.weather.rays <= len(points)
    assert (derainer.waiting, derainer.starts_new_recording(frame)) == (0, False)
    assert list(derainer.flush()) == []


@every_filter
def test_candidates_are_judged_as_without_bounds_and_nothing_else_is_rain(filter_) -> None:
    candidates = Candidates((Bound("range", most=15.0), Bound("z", least=-1.0)))
    points = scene()
    # Copies of one position share the verdict of the first, whatever they measured.
    scan = Scan.of(np.concatenate([points, points[::7] * np.float32([1, 1, 1, 3])]))
    rain, of_candidates = (FilterDerainer(filter_, 0, each)(scan) for each in (None, candidates))
    np.testing.assert_array_equal(of_candidates, rain & candidates.among(scan))
    assert 0 < of_candidates.sum() < rain.sum()


@pytest.mark.parametrize("filter_", [ROR(), DROR(), SOR(), DSOR()], ids=str)
def test_filters_of_places_do_not_look_at_intensity(filter_) -> None:
    derainer, scan = FilterDerainer(filter_), Scan.of(scene())
    np.testing.assert_array_equal(derainer(replace(scan, intensity=None)), derainer(scan))


def test_without_intensity_ssr_finds_nothing() -> None:
    scan = Scan.of(scene())
    everything = FilterDerainer(SSR(threshold=1e30))
    assert everything(scan).all()
    assert not everything(replace(scan, intensity=None)).any()


def test_a_lone_point_is_rain_by_radius_and_not_rain_by_statistics() -> None:
    lone = np.array([[30, 0, 0, 50]], np.float32)
    verdicts = {name: FilterDerainer(filter_from(name, {}))(lone).item() for name in FILTERS}
    assert verdicts == {
        **dict.fromkeys(("ror", "dror"), True),
        **dict.fromkeys(("crf", "sor", "dsor", "ssr"), False),
    }


def test_a_filter_is_found_by_its_name_and_takes_its_parameters() -> None:
    assert filter_from("dsor", {"range_multiplier": 0.08}) == DSOR(5, 0.01, 0.08)
    for name, kind in FILTERS.items():
        filter_ = filter_from(name, {})
        assert type(filter_) is kind
        assert filter_.name == name
        assert filter_from(name, filter_.as_dict()) == filter_
        assert kind.HELP.startswith("rain ")
        assert kind.HELP.splitlines() == [kind.HELP]


def test_a_filter_of_numbers_of_numpy_is_the_same_as_one_of_numbers() -> None:
    of_numpy = DSOR(neighbours=np.int64(7), range_multiplier=np.float32(0.5))
    plain = DSOR(neighbours=7, range_multiplier=0.5)
    assert FilterDerainer(of_numpy).fingerprint() == FilterDerainer(plain).fingerprint()


def test_a_filter_is_called_what_it_is_registered_by_and_its_numbers_are_checked(
    monkeypatch,
) -> None:
    monkeypatch.setattr(FILTERS, "_members", dict(FILTERS))
    # Its annotations are texts, as where a module puts them off.
    fog = make_dataclass("FogRemover", [("reach", "float", 5.0)], bases=(ROR,), frozen=True)
    assert fog().name == "fogremover"
    FILTERS.add("fog")(fog)
    assert filter_from("fog", {"reach": 7}).as_dict()["reach"] == 7
    assert (fog().name, ROR().name) == ("fog", "ror")
    for parameter, value in (("radius", -1), ("reach", "far")):
        with pytest.raises(InputError, match=f"fog: {parameter}: "):
            filter_from("fog", {parameter: value})


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        ("rorr", {}, "rorr: no such filter. Did you mean ror? Give one of crf, dror, dsor, ror,"),
        (
            "ror",
            {"radios": 1},
            "ror: it has no parameter radios. Did you mean radius? It has neighbours, radius.",
        ),
        ("ror", {"radius": -1}, "ror: radius: -1 is not within 0 and 1e+100"),
        ("ror", {"radius": 16**5000}, "ror: radius: the number is too large"),
        ("dsor", {"range_multiplier": float("inf")}, "dsor: range_multiplier: inf is not"),
        ("ssr", {"threshold": True}, "ssr: threshold: True is not a finite number"),
        ("ssr", {"neighbours": 1}, "ssr: neighbours: 1 is not a whole number from 2"),
        ("dror", {"neighbours": 2.5}, "dror: neighbours: 2.5 is not a whole number"),
        ("dror", {"variant": "book"}, "dror: variant: 'book' is not known. Available: code,"),
        ("crf", {"variant": "best"}, "crf: variant: 'best' is not known. Available: fitted,"),
        ("crf", {"neighbours": 3}, "crf: neighbours: 3 is not a whole number from 4 to 200"),
    ],
)
def test_parameters_that_make_no_sense_are_refused(name, parameters, message) -> None:
    with pytest.raises(InputError) as refusal:
        filter_from(name, parameters)
    assert str(refusal.value).startswith(message)
    assert len(str(refusal.value)) < 300


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(["dror"], r"derain\.DROR\(\)"), ([DROR], r"derain\.DROR\(\)"), ([ROR(), -1], "threads: -1")],
)
def test_what_is_no_filter_or_no_number_of_threads_is_refused(arguments, message) -> None:
    with pytest.raises(InputError, match=message):
        FilterDerainer(*arguments)


@pytest.mark.parametrize(
    ("answer", "found"),
    [
        (lambda points: np.zeros(points), "float64 (500,)"),
        (lambda points: np.zeros(points - 1, bool), "bool (499,)"),
        (lambda points: np.zeros(2 * points, bool), "bool (1000,)"),
        (lambda points: None, "object ()"),
    ],
)
@pytest.mark.parametrize("candidates", [None, Candidates((Bound("range", most=15.0),))])
def test_an_answer_that_is_no_bool_for_each_point_is_refused(answer, found, candidates) -> None:
    judge = {"judge": lambda self, view: answer(view.size)}
    wrong = make_dataclass("Wrong", [], bases=(SOR,), namespace=judge, frozen=True)
    message = f"wrong: its answer for 500 points is {found}. Repair the filter: "
    with pytest.raises(InputError, match=re.escape(message)):
        FilterDerainer(wrong(), candidates=candidates)(scene()[:500])
