"""What happens beside training: checkpoints, pictures, reports and label files."""
