"""Places that a sensor stands in, and the ragged things that they are full of."""
