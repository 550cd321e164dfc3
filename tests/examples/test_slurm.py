"""The script for SLURM starts torchrun on every machine, and goes on where its job was stopped."""

import os
import subprocess
from pathlib import Path

from torch.distributed.run import get_args_parser

SCRIPT = Path(__file__).resolve().parents[2] / "examples/slurm/fit.sbatch"

JOB = {
    "SLURM_JOB_ID": "4321",
    "SLURM_JOB_NODELIST": "node[07-08]",
    "SLURM_NNODES": "2",
    "SLURM_GPUS_ON_NODE": "4",
    "SLURM_CPUS_PER_TASK": "8",
}
FIT = ["--config", "outdet_wads.yaml", "--data.root", "my scans"]


def started(folder: Path) -> list[str]:
    """Runs the script in a folder as SLURM does; returns the words of what it has started."""
    commands = {"scontrol": "echo node07; echo node08", "srun": r"""printf '%s\n' "$@" """}
    for name, line in commands.items():
        command = folder / "bin" / name
        command.parent.mkdir(exist_ok=True)
        command.write_text(f"#!/bin/sh\n{line}\n")
        command.chmod(0o755)
    environment = {**os.environ, **JOB, "PATH": f"{folder / 'bin'}:{os.environ['PATH']}"}
    command = ["bash", SCRIPT, *FIT]
    words = subprocess.check_output(command, cwd=folder, env=environment, text=True).splitlines()
    return words[words.index("torchrun") + 1 :]


def test_the_script_starts_torchrun_and_goes_on_from_the_last_checkpoint(tmp_path) -> None:
    parsed = get_args_parser().parse_args(started(tmp_path))
    assert (parsed.nnodes, parsed.nproc_per_node, parsed.no_python) == ("2", "4", True)
    assert parsed.rdzv_endpoint == "node07:24321"
    assert parsed.training_script == "derain"
    assert parsed.training_script_args[:5] == ["fit", *FIT]
    last = tmp_path / "runs/slurm/job_4321/checkpoints/last.ckpt"
    last.parent.mkdir(parents=True)
    last.touch()
    again = get_args_parser().parse_args(started(tmp_path)).training_script_args
    where = ["--ckpt_path", str(last.relative_to(tmp_path))]
    assert again == [*parsed.training_script_args, *where]
