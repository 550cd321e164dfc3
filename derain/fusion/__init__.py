"""LiDAR and 4D radar as one cloud."""
