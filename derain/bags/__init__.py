"""Recordings of ROS: point clouds in bags, read as scans and written without their rain."""
