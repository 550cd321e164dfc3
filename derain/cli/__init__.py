"""The command line."""

import os

# Threads of OpenMP that spin while they wait take the cores from the work that follows, and on a
# busy machine make training many times slower. Read when torch and small_gicp are loaded.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
