"""How much more damage the caregiver leaves in the physical house than in the grid, over several houses, and why.

Prints docs/grid_to_house.md (docs/grid_to_house_NAME.md with --caregiver NAME, for another one than the rule); with
--docs writes it and its figures. The episodes in the house are those of a finished run of `caregiver-mj evaluate
--world house`, with `none` and that caregiver, or else run here. The same are run in the grid, also with a caregiver
that lacks what the robot lacks: to decide before each of three actions, to drive as fast, to be held up by the child no
more than the grid's caregiver is.

How long the robot takes is seen in a few of the episodes, which it does again, watched from outside once a control
timestep. A phase is one skill: to block a stairwell (until the base is there), to fetch a candle (until it is off the
table) or to carry it (until it stands on another one and the hand is back). A phase that another target ends early
has no counterpart in the grid, and is only counted.
"""
