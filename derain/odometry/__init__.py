"""How the sensor moved from scan to scan, found from the scans themselves."""
