"""The command of derain that is installed beside this Python."""

import sysconfig
from pathlib import Path

# Not a module of it: Lightning starts the command again for each further process.
DERAIN = Path(sysconfig.get_path("scripts")) / "derain"
