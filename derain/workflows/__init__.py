"""The longer commands as functions: odometry, teaching, training, learning from a recording."""
