"""One scan as several methods clean it, in a window to turn and zoom in."""

import os
import sys
from collections.abc import Mapping

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from derain.errors import InputError
from derain.pictures.palette import BACKGROUND, OUTCOMES, outcomes
from derain.scan import Scan
from derain.system.open3d_import import import_open3d


def show_comparison(
    scan: Scan, predicted: Mapping[str, NDArray[np.bool_]], rain: NDArray[np.bool_] | None
) -> None:
    """Opens a window for each method, one after the other, in the colours of the pictures.

    Args:
        scan: The scan.
        predicted: Points that each method calls rain, bool (N,), by its name.
        rain: Points that are rain, bool (N,); None where it is not known.

    Raises:
        InputError: No screen, or no Open3D.
    """
    if sys.platform == "linux" and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise _no_screen()
    open3d = import_open3d()
    colours = np.array([to_rgb(colour) for colour in OUTCOMES.values()])
    seen = scan.valid
    for name, called_rain in predicted.items():
        outcome = outcomes(called_rain, called_rain if rain is None else rain)
        cloud = open3d.geometry.PointCloud(
            open3d.utility.Vector3dVector(scan.xyz[seen].astype(np.float64))
        )
        cloud.colors = open3d.utility.Vector3dVector(colours[outcome[seen]])
        window = open3d.visualization.Visualizer()
        if not window.create_window(window_name=f"{scan.name}: {name}"):
            raise _no_screen()
        window.add_geometry(cloud)
        window.get_render_option().background_color = np.array(to_rgb(BACKGROUND))
        window.get_render_option().point_size = 2.0
        window.run()
        window.destroy_window()


def _no_screen() -> InputError:
    return InputError("--window", "there is no screen to open it on", "Give --out for a PNG.")
