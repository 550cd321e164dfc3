"""The parts of training: batches, losses, and random draws."""
