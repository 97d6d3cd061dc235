"""Whether what `foresight` believes of a child comes true: predicted collisions against those that happened.

Children are left alone in houses of the grid that nobody has seen. Before each of their moves the belief says how
probable it is that the child bumps into each stairwell and table within the next 1, 5 and 15 timesteps. Prints
docs/calibration.md; with --docs writes it and its figures.
"""
