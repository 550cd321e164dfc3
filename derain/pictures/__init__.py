"""Pictures of scans, data sets and results."""
