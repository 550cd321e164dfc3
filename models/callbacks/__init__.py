"""Callbacks of training: checkpoints, pictures, reports and label files."""
