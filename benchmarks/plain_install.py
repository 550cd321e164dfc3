"""From the wheel alone to a cleaned scan, on a machine that has Python and nothing of derain.

    python -m benchmarks.plain_install SCAN                      this Python
    python -m benchmarks.plain_install SCAN --python python3.12

Builds the wheel, makes a new environment, installs the wheel without extras from the registry, and
cleans the scan by the model of derain's own. Prints the time of each step, the packages,
their megabytes, and that no package of an extra is installed. The registry's files may
come from pip's cache, which --cold leaves alone.
"""

import argparse
import sys
import tempfile
from pathlib import Path
from time import perf_counter

from derain.system.extras import EXTRAS
from release.build import build
from release.environment import Environment

# Whether a module can be found there, for each of those that are asked for.
FIND = "import sys; from importlib.util import find_spec; print(*filter(find_spec, sys.argv[1:]))"

# What has nothing to do with derain, and comes with one of its plain dependencies.
OF_ONNXRUNTIME = {"flatbuffers"}


def main() -> None:
    """Measures, and prints one line a step."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scan", type=Path)
    parser.add_argument("--python", default=sys.executable, help="(default: this one)")
    parser.add_argument("--cold", action="store_true", help="take nothing from pip's cache")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        wheel, _ = build(folder / "dist")
        times = [perf_counter()]
        environment = Environment(folder / "environment", arguments.python)
        times.append(perf_counter())
        environment.install(*(["--no-cache-dir"] if arguments.cold else []), wheel)
        times.append(perf_counter())
        scan = arguments.scan.resolve()
        printed = environment.run("derain", "run", scan, "--out", folder / "cleaned")
        times.append(perf_counter())
        print(printed.rstrip())
        print(*sorted(file.name for file in (folder / "cleaned").iterdir()))
        steps = zip(("environment", "install", "run"), times, times[1:], strict=False)
        print(", ".join(f"{step} {end - start:.1f} s" for step, start, end in steps))
        print(f"from the wheel to a cleaned scan: {times[-1] - times[0]:.1f} s")
        packages = environment.packages()
        print(f"{environment.megabytes():.0f} MB:", ", ".join(map(" ".join, packages.items())))
        refuse_extras(environment)


def refuse_extras(environment: Environment) -> None:
    """Checks that no package of an extra is installed; fails otherwise."""
    libraries = {extra.library for extra in EXTRAS} - OF_ONNXRUNTIME
    found = environment.run(environment.python, "-c", FIND, *sorted(libraries)).split()
    if found:
        sys.exit(f"plain derain brings {', '.join(found)}")
    print("not there:", ", ".join(sorted(libraries)))


if __name__ == "__main__":
    main()
