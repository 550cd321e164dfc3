"""Data cards, one YAML a data set: what must be known of it to train and to measure."""
