"""Data cards, one YAML a data set: its classes, units, statistics and layout."""
