"""Columns of fused scans reach the models that name them, and no other."""

import numpy as np
import pytest

from derain.datamodules.base import Loading
from derain.datamodules.folder import Folder
from derain.evaluation.hard_cases import scene
from derain.files import write_scan
from derain.files.labels import write_labels
from derain.learning.task import agree_on_task
from derain.models.outdet import OutDet
from derain.scan import Scan

COLUMNS = ("x", "y", "z", "intensity", "radar", "doppler", "rcs")
CARD = "name: fused\nclasses: {0: other, 3: rain}\nrain: [3]\n"


def fused(seed: int, points: int = 60) -> Scan:
    """A scan whose last ten points are a radar's."""
    rng = np.random.default_rng(seed)
    columns = dict(zip(COLUMNS[:4], scene(points, seed).T, strict=True))
    is_radar = np.arange(points) >= points - 10
    columns["radar"] = np.float32(is_radar)
    for name in ("doppler", "rcs"):
        columns[name] = np.where(is_radar, rng.normal(3, 2, points), np.nan).astype(np.float32)
    return Scan(scene(points, seed)[:, :3], columns["intensity"], fields=columns)


@pytest.fixture(params=["bin", "npz"])
def data(request, tmp_path) -> Folder:
    """A data module of three fused scans in a format."""
    for number in range(3):
        path = tmp_path / f"{number}.{request.param}"
        write_scan(path, fused(number))
        write_labels(path.with_suffix(".label"), np.arange(60) % 2 * 3)
    (tmp_path / "card.yaml").write_text(CARD)
    parts = {part: [f"*.{request.param}"] for part in ("train", "validation", "test")}
    loading = Loading(columns=COLUMNS)
    return Folder(str(tmp_path), str(tmp_path / "card.yaml"), **parts, loading=loading)


def test_extra_channels_are_measured_and_batched_for_a_model_that_names_them(data) -> None:
    assert set(data.reader.read(data.frames("train")[0]).fields) == set(
        COLUMNS
    )  # without a model: all
    model = OutDet(channels=("x", "y", "z", "intensity", "rcs", "radar", "doppler"))
    agree_on_task(model, data)
    scans = [fused(number) for number in range(3)]
    for name in ("radar", "doppler", "rcs"):
        values = np.concatenate([scan.fields[name] for scan in scans])
        expected = (np.nanmean(values), np.nanstd(values))
        np.testing.assert_allclose(data.card.moments[name], expected, rtol=1e-5)
    assert model.spec.units[4:] == ("dBsm", "0 or 1", "m/s")
    for number, batch in enumerate(data.test_dataloader()):
        (measured,) = batch.measured
        assert set(measured.scan.fields) == {"radar", "doppler", "rcs"}
        points = batch.inputs["points"].numpy()
        rows = model.spec.make_view()(measured.scan).first
        for place, name in enumerate(model.channels):
            column = scans[number].channel(name)[rows]
            known = ~np.isnan(column)
            np.testing.assert_array_equal(points[known, place], column[known])
            np.testing.assert_array_equal(points[~known, place], np.float32(model.spec.mean[place]))
