"""Floor plans: what stands where in a house, on the grid and in metres."""
