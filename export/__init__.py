"""From a checkpoint to an ONNX file that a CPU runs without torch, with its proof."""
