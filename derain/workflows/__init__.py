"""What commands do, as functions: odometry, teaching, training, learning from a recording."""
