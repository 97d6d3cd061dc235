"""The physical house: its scene and its simulation."""
