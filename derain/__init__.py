"""derain takes the rain out of LiDAR and fused LiDAR + 4D-radar scans.

This package's root is NumPy only and quick to import: scans, files, views and the Spec.
"""

from derain.errors import InputError
from derain.scan import Scan

__all__ = ["InputError", "Scan", "__version__"]

__version__ = "0.1.0"
