"""``derain export``: an ONNX file from a checkpoint, proved and timed."""

import argparse
from pathlib import Path

from derain.cli.arguments import count, threads

SUMMARY = "make an ONNX file that runs on a CPU without torch"

DESCRIPTION = """\
Exports a checkpoint as one ONNX file, proves it against PyTorch, and times it.

  derain export outdet.ckpt --out outdet.onnx
  derain export outdet.ckpt --out outdet.onnx --scan scans/000000.bin --threads 2

Where the proof fails, no file is left.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("checkpoint", type=Path, help="checkpoint of derain")
    parser.add_argument("--out", type=Path, required=True, help="the ONNX file to write")
    parser.add_argument(
        "--scan", type=Path, help="time the model on this scan; by default on a made-up one"
    )
    parser.add_argument("--columns", default="x,y,z,intensity", help="columns of a .bin --scan")
    parser.add_argument(
        "--threads", type=threads, default=0, help="threads to time with (default all)"
    )
    parser.add_argument("--repeats", type=count, default=30, help="timed runs (default 30)")


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    from derain.errors import InputError
    from derain.export.latency import measure_latency
    from derain.export.onnx_file import export
    from derain.models.checkpoint import load_model

    if arguments.scan is not None and not arguments.scan.is_file():
        raise InputError(arguments.scan, "there is no such file", "Check --scan.")
    proof = export(load_model(arguments.checkpoint), arguments.out)
    print(proof)
    print(f"Wrote {arguments.out} ({arguments.out.stat().st_size:,} bytes)\n")
    print(
        measure_latency(
            arguments.out,
            arguments.scan,
            arguments.columns.split(","),
            arguments.threads,
            arguments.repeats,
        )
    )
    return 0
