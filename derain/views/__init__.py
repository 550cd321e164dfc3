"""What networks and filters see of a scan, and the back-projection to its points."""
