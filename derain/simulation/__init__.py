"""Simulated rain: ray-cast tracks and drives, rain drawn per beam, files like REHEARSE-3D's."""
