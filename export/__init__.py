"""From a checkpoint to an ONNX file that a CPU runs without torch, with its proof."""

import os

# From 1.29 on, onnxruntime tells its makers of every model that it opens, unless this is set before
# it is imported. What runs on a robot tells nobody; whoever wants it to sets the variable to 0.
os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")
