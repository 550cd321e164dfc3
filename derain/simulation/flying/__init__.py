"""Particles in the beams of a sensor: drops, flakes, drifting snow, spray and haze."""
