"""Trains and measures as a process of torchrun, which gives each command its turn.

torchrun ... two_machines.py CONFIG CHECKPOINT
"""

import sys

from derain.cli.main import main

if __name__ == "__main__":
    config, checkpoint = sys.argv[1:]
    main(["fit", "--config", config])
    assert main(["test", "--config", config, "--ckpt_path", checkpoint]) == 0
