"""What networks and filters see of a scan, and the way back to its points."""
