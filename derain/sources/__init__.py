"""Sources of scans, and sinks for results."""
