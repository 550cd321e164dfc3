"""Simulated rain: a ray-cast test track, rain drawn per beam, files like REHEARSE-3D's."""
