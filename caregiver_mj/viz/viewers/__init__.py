"""Viewers: an episode to watch while it runs, and to take a hand in, in a browser or in MuJoCo's own window."""
