"""Places around a sensor, and the irregular things in them."""
