"""The dm-control tasks, one file each, and their registry."""
