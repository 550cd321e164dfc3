"""From a checkpoint to an ONNX file that a CPU runs without torch, with its proof."""

import os

# From 1.29 on, onnxruntime reports every model that it opens to its makers, unless this is set
# before it is imported. A robot reports nothing; whoever wants the reports sets the variable to 0.
os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")
