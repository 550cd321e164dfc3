"""Evidence from several scans of a recording: poses of the sensor, and persistence of points."""
