"""ROR and SOR against Open3D's, which have the same semantics."""

from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.filters import ROR, SOR, FilterDerainer
from derain.system.open3d_import import import_open3d


@pytest.fixture(scope="module")
def open3d() -> ModuleType:
    try:
        return import_open3d()
    except InputError as error:
        pytest.skip(str(error))


def cloud(open3d: ModuleType, points: NDArray[np.float32]) -> object:
    return open3d.geometry.PointCloud(
        open3d.utility.Vector3dVector(points[:, :3].astype(np.float64))
    )


def removed(kept: list[int], points: int) -> NDArray[np.bool_]:
    rain = np.ones(points, bool)
    rain[np.asarray(kept, np.int64)] = False
    return rain


@pytest.mark.parametrize(("others", "radius"), [(1, 0.3), (3, 0.6), (8, 1.5)])
def test_ror_removes_what_open3d_removes(open3d: ModuleType, others: int, radius: float) -> None:
    points = scene(2000)
    _, kept = cloud(open3d, points).remove_radius_outlier(others, radius)
    expected = removed(kept, len(points))
    assert 0.05 < expected.mean() < 0.95
    derainer = FilterDerainer(ROR(neighbours=others + 1, radius=radius))
    np.testing.assert_array_equal(derainer(points), expected)


@pytest.mark.parametrize(("neighbours", "deviations"), [(2, 0.5), (5, 0.01), (20, 1.0)])
def test_sor_removes_what_open3d_removes(
    open3d: ModuleType, neighbours: int, deviations: float
) -> None:
    points = scene(2000)
    _, kept = cloud(open3d, points).remove_statistical_outlier(neighbours, deviations)
    expected = removed(kept, len(points))
    assert 0.02 < expected.mean() < 0.95
    derainer = FilterDerainer(SOR(neighbours, deviations))
    np.testing.assert_array_equal(derainer(points), expected)
