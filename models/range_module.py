"""What derainers on range images share: their grid, and their pixels one by one."""

from collections.abc import Sequence

from torch import Tensor

from derain.errors import InputError
from derain.models.base import DerainingModule
from derain.scan import Scan
from derain.views.grid_fit import fit_grid
from derain.views.range_image import RangeView
from derain.views.spherical_grid import grid_of

# In place of a grid's name: the one that fits the training scans.
FITTED = "fitted"


def range_view(model: DerainingModule, scans: Sequence[Scan]) -> RangeView:
    """A view on a grid that is stated, or fitted to scans.

    It goes by the model's ``grid``, which is ``fitted`` for one that fits the scans, or the name of
    a published grid, or its bounds, as :func:`~derain.views.spherical_grid.grid_of` takes them; and
    by its ``back_projection``.

    Args:
        model: The model.
        scans: Training scans.

    Raises:
        InputError: An unknown grid or back-projection, or a grid to fit without scans.
    """
    grid = model.hparams["grid"]
    if grid == FITTED and not scans:
        raise InputError("grid", "there are no scans to fit it to", "Give a grid by its name.")
    chosen = fit_grid(scans).grid if grid == FITTED else grid_of(grid, "grid")
    return RangeView(chosen, model.channels, model.hparams["back_projection"])


def require_grid(grid: str | None, name: str) -> str:
    """The grid of published weights, which has to be stated.

    Args:
        grid: Name of the grid, if there is one.
        name: Name of the network, for messages.

    Raises:
        InputError: There is none.
    """
    if grid is None:
        raise InputError(
            name, "weights do not record the grid that they were trained on", "Give --grid."
        )
    return grid


def per_pixel(image: Tensor) -> Tensor:
    """One row a pixel: float (B, C, H, W) to (B · H · W, C)."""
    return image.movedim(1, -1).flatten(0, 2)
