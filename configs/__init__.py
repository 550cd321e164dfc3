"""Packaged configurations, one YAML per model and data set, found by name."""
