"""Times the filters against each other, against versions on KD-trees, and against Open3D's.

    python benchmarks/filters.py WADS/sample.bin --threads 2

Array in, mask out, trees and views included. Libraries that are not installed are left out:
pip install scipy scikit-learn
"""

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from libraries import installed
from turns import milliseconds_in_turns

from derain.errors import InputError
from derain.export.timing import versions
from derain.files import read_scan
from derain.filters import CRF, DROR, DSOR, ROR, SOR, SSR, FilterDerainer, PointFilter
from derain.scan import Bools, Floats, Scan
from derain.system.open3d_import import import_open3d

ROUNDS = 9

Method = Callable[[], Bools]


def main() -> None:
    """Prints the medians of all filters, and the ratios of their rivals to ours."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scan", type=Path)
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args()

    scan = read_scan(arguments.scan)
    scan = scan.take(scan.valid)
    xyz = scan.xyz.astype(np.float64)
    print(f"{len(scan):,} points, {arguments.threads} threads, median of {ROUNDS}")
    _report_in_turns(scan, arguments.threads)
    for filter_, rivals in (
        (DROR(), _dror(xyz, arguments.threads)),
        (DSOR(), _dsor(xyz, arguments.threads)),
        (ROR(), _ror(xyz)),
        (SOR(), _sor(xyz)),
    ):
        derainer = FilterDerainer(filter_, arguments.threads)
        _report(filter_, {"derain": lambda derainer=derainer: derainer(scan), **rivals})
    print(versions())


def _dror(xyz: Floats, threads: int) -> dict[str, Method]:
    """DROR with searches by radius."""
    radius, enough = DROR().radius_at(xyz), DROR().neighbours
    rivals: dict[str, Method] = {}
    if spatial := installed("scipy.spatial"):
        rivals["SciPy cKDTree by radius"] = lambda: (
            spatial.cKDTree(xyz).query_ball_point(xyz, radius, workers=threads, return_length=True)
            < enough
        )
    if sklearn := installed("sklearn.neighbors"):
        rivals["scikit-learn KDTree by radius, 1 thread"] = lambda: (
            sklearn.KDTree(xyz).query_radius(xyz, radius, count_only=True) < enough
        )
    return rivals


def _dsor(xyz: Floats, threads: int) -> dict[str, Method]:
    """DSOR with searches for nearest neighbours."""
    dsor = DSOR()

    def judge(distances: Floats) -> Bools:
        mean = distances[:, 1:].mean(axis=1)
        usual = mean.mean() + dsor.deviation_multiplier * mean.std(ddof=1)
        return mean >= usual * dsor.range_multiplier * np.linalg.norm(xyz, axis=1)

    rivals: dict[str, Method] = {}
    if spatial := installed("scipy.spatial"):
        rivals["SciPy cKDTree"] = lambda: judge(
            spatial.cKDTree(xyz).query(xyz, dsor.neighbours, workers=threads)[0]
        )
    if sklearn := installed("sklearn.neighbors"):
        rivals["scikit-learn KDTree, 1 thread"] = lambda: judge(
            sklearn.KDTree(xyz).query(xyz, dsor.neighbours)[0]
        )
    return rivals


def _ror(xyz: Floats) -> dict[str, Method]:
    return _of_open3d(
        xyz, lambda cloud: cloud.remove_radius_outlier(ROR().neighbours - 1, ROR().radius)
    )


def _sor(xyz: Floats) -> dict[str, Method]:
    sor = SOR()
    return _of_open3d(
        xyz,
        lambda cloud: cloud.remove_statistical_outlier(sor.neighbours, sor.deviation_multiplier),
    )


def _of_open3d(
    xyz: Floats, remove: Callable[[object], tuple[object, list[int]]]
) -> dict[str, Method]:
    """Open3D's own filter, on every core of the machine."""
    try:
        open3d = import_open3d()
    except InputError:
        return {}

    def removed() -> Bools:
        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(xyz))
        _, kept = remove(cloud)
        rain = np.ones(len(xyz), bool)
        rain[np.asarray(kept, np.int64)] = False
        return rain

    return {"Open3D, all cores": removed}


def _report_in_turns(scan: Scan, threads: int) -> None:
    """Prints the time of each filter relative to DSOR."""
    filters = (DSOR(), CRF(), CRF(variant="published"), SSR(), SOR(), DROR(), ROR())
    # A scan of its own for every run, so that nobody finds ranges that another has worked out.
    derainers = {
        str(filter_): lambda filter_=filter_: FilterDerainer(filter_, threads)(replace(scan))
        for filter_ in filters
    }
    times = milliseconds_in_turns(derainers, ROUNDS)
    usual = np.median(times[str(DSOR())])
    for name, values in times.items():
        median = np.median(values)
        print(f"{median:7.1f} ms, {median / usual:4.2f} of DSOR's: {name}")


def _report(filter_: PointFilter, methods: dict[str, Method]) -> None:
    verdicts = {name: method() for name, method in methods.items()}
    times = milliseconds_in_turns(methods, ROUNDS)
    print(filter_)
    ours = np.median(times["derain"])
    for name, values in times.items():
        differ = int((verdicts[name] != verdicts["derain"]).sum())
        print(
            f"  {name:40} {np.median(values):7.1f} ms, {np.median(values) / ours:5.1f} times ours; "
            f"differs on {differ} points"
        )


if __name__ == "__main__":
    main()
