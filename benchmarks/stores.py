"""Cleans a source from a folder and from an object store that works or fails, and lists many keys.

    python -m benchmarks.stores drive/ --method dror --block 5
    python -m benchmarks.stores drive/ --method default --keys 100000

The store is a server of S3 on this machine. The failing one refuses every tenth request and cuts
every fiftieth read of an object at its half. Prints seconds, requests, and whether the results are
those of the folder, byte for byte; then the seconds to list as many keys, of recordings of 1,000
scans, in a store in memory, which shows derain's own share. Ends with 1 where bytes differ.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import fsspec

from benchmarks.s3_server import BUCKET, Faults, file_system, s3_server
from derain.cli.main import main as derain
from derain.evaluation.text_tables import markdown_table
from derain.sources.store_listing import frames_at

REFUSE, CUT = 10, 50


def main() -> int:
    """Cleans, compares and prints."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("drive", type=Path, help="folder of scans or bags")
    parser.add_argument("--method", default="default", help="what cleans them (default: default)")
    parser.add_argument("--block", default="5", help="scans of a unit (default: 5)")
    parser.add_argument("--keys", type=int, default=100_000, help="to be listed (default: 100000)")
    arguments = parser.parse_args()
    options = ["--block", arguments.block, "--resume"]
    with tempfile.TemporaryDirectory() as name:
        out = Path(name, "out")
        rows = [
            ["folder", f"{cleaned(arguments.method, arguments.drive, out, options):.1f}", "", ""]
        ]
        expected = {file.relative_to(out).as_posix(): file.read_bytes() for file in files_in(out)}
    same = True
    for kind, refuse, cut in (("store", 0, 0), ("failing store", REFUSE, CUT)):
        faults = Faults()
        with s3_server(faults):
            store = file_system()
            store.put(f"{arguments.drive}/", f"{BUCKET}/in/", recursive=True)
            faults.requests, faults.refuse, faults.cut = 0, refuse, cut
            source, target = f"s3://{BUCKET}/in/", f"s3://{BUCKET}/out"
            seconds = cleaned(arguments.method, source, target, options)
            requests, faults.refuse, faults.cut = faults.requests, 0, 0
            equal = results(store) == expected
        rows.append([kind, f"{seconds:.1f}", f"{requests:,}", "yes" if equal else "NO"])
        same = same and equal
    print(markdown_table(("source and results", "seconds", "requests", "same bytes"), rows))
    seconds = seconds_to_list(arguments.keys)
    print(f"{arguments.keys:,} keys are listed in {seconds:.1f} s")
    return 0 if same else 1


def cleaned(method: str, source: Path | str, out: Path | str, options: list[str]) -> float:
    """Cleans a source, and returns the seconds."""
    began = time.perf_counter()
    derain(["run", method, str(source), "--out", str(out), *options])
    return time.perf_counter() - began


def files_in(out: Path) -> list[Path]:
    """The results in a folder."""
    return [file for file in out.rglob("*") if file.is_file() and ".derain" not in file.parts]


def results(store: Any) -> dict[str, bytes]:
    """The results in the store by their paths."""
    keys = [key for key in store.find(f"{BUCKET}/out") if "/.derain/" not in key]
    return {key.removeprefix(f"{BUCKET}/out/"): store.cat_file(key) for key in keys}


def seconds_to_list(keys: int) -> float:
    """Seconds to list so many scans in a store in memory."""
    memory = fsspec.filesystem("memory")
    for number in range(keys):
        recording, scan = divmod(number, 1000)
        memory.pipe(f"/drives/sequences/{recording:04d}/velodyne/{scan:06d}.bin", b"")
    began = time.perf_counter()
    frames = frames_at(["memory://drives"])
    assert len(frames) == keys
    return time.perf_counter() - began


if __name__ == "__main__":
    sys.exit(main())
