"""Several data sets at once: each with its labels, its weight and its place in the report."""

from collections import Counter
from dataclasses import replace

import lightning
import numpy as np
import pytest

from derain.cards.card import DataCard, load_card
from derain.datamodules.augmentation import Augmentation
from derain.datamodules.base import Loading
from derain.datamodules.folder import Folder
from derain.datamodules.in_memory import InMemory
from derain.datamodules.mixture import Mixture
from derain.errors import InputError
from derain.evaluation.counts import Counts
from derain.evaluation.hard_cases import scene
from derain.learning.task import agree_on_task
from derain.models.outdet import OutDet
from derain.scan import Scan
from derain.sources.source import Frames
from derain.sources.training_record import training_overlap

STILL = Augmentation(rotation_probability=0, jitter_probability=0)
# Of the same ids, one data set calls rain what the other is sure is none, or does not know.
SNOW = DataCard("snow", {0: "ground", 1: "flake", 2: "drift"}, rain=(1,), licence="free")
SPRAY = DataCard("spray", {0: "wet", 1: "road", 2: "haze"}, rain=(0,), unknown=(2,), licence="dear")


def scans(number: int, ids: list[int], first: int = 0) -> list[Scan]:
    """Scans of 40 points, whose labels repeat some ids."""
    label = np.resize(ids, 40)
    return [Scan.of(scene(40, seed)).with_label(label) for seed in range(first, first + number)]


def part(card: DataCard, number: int = 4, first: int = 0, **loading: object) -> InMemory:
    """A data set of so many training scans, and half as many to validate."""
    train, validation = scans(number, [0, 1, 2], first), scans(number // 2, [0, 1, 2], first + 50)
    return InMemory(train, validation, validation, card=card, loading=Loading(**loading))


def mixture(**options: object) -> Mixture:
    parts = {"snow": part(SNOW), "spray": part(SPRAY, 8, 20)}
    return Mixture(parts, **{"loading": Loading(augmentation=STILL), **options})


def test_labels_are_read_by_the_card_of_their_part() -> None:
    data = mixture()
    for frame in data.source("train"):
        scan = data.reader.read(frame)
        own = SNOW if frame.key.startswith("snow/") else SPRAY
        before = scan.with_label(np.resize([0, 1, 2], 40))
        np.testing.assert_array_equal(data.card.rain_of(scan), own.rain_of(before))
        np.testing.assert_array_equal(data.card.unknown_of(scan), own.unknown_of(before))
    assert sorted(data.card.classes.values()) == sorted(
        ["snow: ground", "snow: flake", "snow: drift", "spray: wet", "spray: road", "spray: haze"]
    )
    assert (data.card.name, data.card.licence) == ("snow + spray", "free (snow); dear (spray)")


def test_an_epoch_has_the_shares_that_the_weights_ask_for() -> None:
    data = mixture(weights={"snow": 3.0}, scans_per_epoch=20)
    agree_on_task(OutDet(neighbours=3), data)
    loader = data.train_dataloader()
    for epoch in range(3):
        loader.sampler.set_epoch(epoch)
        keys = [loader.dataset.frames[pick.number].key for pick in loader.sampler]
        assert Counter(key.split("/")[0] for key in keys) == {"snow": 15, "spray": 5}
    assert len(mixture().draws().drawn) == 2
    assert sum(mixture().draws().drawn) == 12  # as many as there are


def test_a_scan_that_is_drawn_twice_is_augmented_in_two_ways() -> None:
    data = mixture(weights={"snow": 3.0}, scans_per_epoch=20, loading=Loading())
    agree_on_task(OutDet(neighbours=3), data)
    loader = data.train_dataloader()
    seen = [(pick, loader.dataset[pick].scan.xyz.tobytes()) for pick in loader.sampler]
    assert max(Counter(pick.number for pick, _ in seen).values()) == 4
    assert len({xyz for _, xyz in seen}) > 12  # of 20, a quarter is left as it is


def test_statistics_are_those_of_a_scan_that_is_drawn() -> None:
    data = mixture(weights={"snow": 1.0, "spray": np.float32(3)})
    data.complete_card()
    points = {
        name: np.concatenate([np.c_[s.xyz, s.intensity] for s in scans(number, [0], first)])
        for name, number, first in (("snow", 4, 0), ("spray", 8, 20))
    }
    drawn = np.concatenate([points["snow"]] * 2 + [points["spray"]] * 3)  # 8 scans and 24
    drawn = drawn.astype(np.float64)
    pooled = [data.card.statistics(name) for name in ("x", "y", "z", "intensity")]
    mean, std = zip(*pooled, strict=True)
    np.testing.assert_allclose(mean, drawn.mean(axis=0), rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(std, drawn.std(axis=0), rtol=1e-5)
    assert data.card.rain_share == pytest.approx(0.25 * 13 / 40 + 0.75 * 14 / 27)


def test_each_part_is_read_in_its_own_unit() -> None:
    data = Mixture({"one": part(SNOW), "two": part(SNOW, intensity_scale=100.0)})
    frames = data.source("train")
    one, two = data.reader.read(frames[0]), data.reader.read(frames[4])
    np.testing.assert_allclose(two.intensity, 100 * one.intensity, rtol=1e-6)
    data.complete_card()
    mean = np.mean([s.intensity for s in scans(4, [0])])
    assert data.card.statistics("intensity")[0] == pytest.approx(50.5 * mean, rel=1e-5)


def test_validation_is_of_all_parts_together_and_reported_for_each(tmp_path) -> None:
    lightning.seed_everything(3)
    model, data = OutDet(neighbours=3), mixture()
    options = {"logger": False, "enable_checkpointing": False, "num_sanity_val_steps": 0}
    run = lightning.Trainer(max_epochs=1, accelerator="cpu", **options)
    run.fit(model, data)
    logged = {name: float(value) for name, value in run.callback_metrics.items()}
    predicted = [rain > 0.5 for batch in run.predict(model, data) for rain in batch]
    counts = []
    for own, frames in ((SNOW, scans(2, [0, 1, 2], 50)), (SPRAY, scans(4, [0, 1, 2], 70))):
        answers = [predicted.pop(0) for _ in frames]
        known = [~own.unknown_of(scan) for scan in frames]
        counts.append(
            Counts.of(
                np.concatenate([a[k] for a, k in zip(answers, known, strict=True)]),
                np.concatenate([own.rain_of(s)[k] for s, k in zip(frames, known, strict=True)]),
            )
        )
    snow, spray = counts
    hits = snow.true_positive + spray.true_positive
    errors = sum(c.false_positive + c.false_negative for c in counts)
    assert logged["val/iou"] == pytest.approx(hits / (hits + errors))
    assert logged["val/snow/iou"] == pytest.approx(snow.iou)
    assert logged["val/spray/recall"] == pytest.approx(spray.recall)


def test_only_parts_that_are_named_are_measured() -> None:
    data = mixture(measured=["spray"])
    keys = [frame.key for frame in data.source("validation")]
    assert keys == [f"spray/{number:06d}" for number in range(4)]
    assert len(data.source("train")) == 12


def test_the_record_holds_the_scans_of_all_parts(tmp_path, write) -> None:
    for number in range(3):
        write(tmp_path / f"{number}.bin", tmp_path / f"{number}.label", [0, 110])
    files = Folder(str(tmp_path), "wads", train=["*.bin"])
    data = Mixture({"files": files, "memory": part(SNOW)}, measured=["memory"])
    spec = agree_on_task(OutDet(neighbours=3, channels=("range",)), data).spec
    assert len(spec.training["scans"]) == 7 - 2  # the three files hold the same points
    for source, card in ((files.source("train"), files.card), (part(SNOW).source("train"), SNOW)):
        overlap = training_overlap("model", spec, card, source)
        assert f"on {len(source)} of these {len(source)} scans" in overlap
    others = Frames.of_scans(scans(2, [0], 90))
    assert training_overlap("model", spec, SNOW, others) is None


def test_sequences_are_recorded_under_the_name_of_their_data() -> None:
    class Published(InMemory):
        """Records sequences by their names, as published data sets do."""

        def training_record(self) -> dict[str, tuple[str, ...]]:
            return {"sequences": ("14", "15")}

    snow = Published(scans(2, [0, 1]), scans(1, [0, 1]), card=load_card("wads"))
    data = Mixture({"snow": snow, "spray": part(SPRAY)})
    spec = agree_on_task(OutDet(neighbours=3, channels=("range",)), data).spec
    assert spec.training["sequences of WADS"] == ("14", "15")
    of_15 = Frames.of_scans(scans(2, [0], 90), sequence="15")
    assert "on 2 of these 2" in str(training_overlap("model", spec, load_card("wads"), of_15))
    assert training_overlap("model", spec, SPRAY, of_15) is None


def test_a_part_needs_the_columns_that_the_model_sees() -> None:
    fields = [replace(scan, fields={"doppler": scan.xyz[:, 0]}) for scan in scans(3, [0, 1])]
    data = Mixture({"radar": InMemory(fields, fields, card=SNOW), "plain": part(SNOW)})
    model = OutDet(neighbours=3, channels=("range", "doppler"))
    with pytest.raises(InputError, match=r"doppler.* has a column"):
        agree_on_task(model, data)


def test_units_that_differ_are_refused_where_intensity_is_seen() -> None:
    percent = replace(SNOW, intensity_unit="0..1")
    data = Mixture({"one": part(replace(SNOW, intensity_unit="0..255")), "two": part(percent)})
    agree_on_task(OutDet(neighbours=3), data)
    with pytest.raises(InputError, match=r"0\.\.1, 0\.\.255"):
        data.train_dataloader()
    agree_on_task(OutDet(neighbours=3, channels=("range",)), data)
    assert len(data.train_dataloader()) == 8


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"parts": {}}, "parts: no class of them is rain"),
        ({"parts": {"a/b": part(SNOW)}}, "part 'a/b': is no plain name"),
        ({"parts": {"dry": part(replace(SNOW, rain=()))}}, "no class of them is rain"),
        ({"weights": {"snow": 0.0}}, "weights: snow: 0 is not above 0"),
        ({"weights": {"snow": float("nan")}}, "weights: snow: nan is not a finite number"),
        ({"weights": {"sleet": 1.0}}, "part 'sleet': there is none. Parts: snow"),
        ({"measured": ["sleet"]}, "part 'sleet': there is none"),
        ({"loading": Loading(intensity_scale=2.0)}, "intensity_scale: would be that of all"),
        ({"parts": {"all": mixture()}}, "part 'all': is a mixture itself"),
    ],
)
def test_what_makes_no_mixture_is_refused(options, message) -> None:
    with pytest.raises(InputError) as error:
        Mixture(**{"parts": {"snow": part(SNOW)}, **options})
    assert message in str(error.value)
