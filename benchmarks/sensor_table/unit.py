"""Intensities in the unit that a method is for."""

import numpy as np

from derain.scan import Scan
from derain.views.full_scale import full_scale
from derain.views.scan_issues import SCALE_OF_UNIT


def factor_for(spec_or_filter: object, scan: Scan) -> float:
    """What takes a scan's intensities to the unit of a method; 1 where either has none.

    Args:
        spec_or_filter: What the method judges by: a filter, or the Spec of a model.
        scan: The scan.
    """
    unit = getattr(spec_or_filter, "intensity_unit", "")
    wanted = getattr(spec_or_filter, "FULL_SCALE", SCALE_OF_UNIT.get(unit))
    own = full_scale([scan])
    return wanted / own if wanted is not None and np.isfinite(own) else 1.0
