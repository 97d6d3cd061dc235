"""What the caregiver prevents in the grid and in the physical house, in the same episodes, and where its time goes.

Prints docs/grid_to_house.md; with --docs writes it and its figures. The robot is watched from outside, once a control
timestep. A phase is one skill: to block a stairwell (until the base is there), to fetch a candle (until it is off the
table) or to carry it (until it stands on another one and the hand is back). A phase that another target ends early
has no counterpart in the grid, and is only counted.
"""
