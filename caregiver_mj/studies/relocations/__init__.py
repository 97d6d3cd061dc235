"""Relocates candles in three houses, over and over, and says how well and how quickly that goes.

Each relocation has a seed of its own, and with it its toddler, tables, candles and start. Candles stand off their
tables' centres, tables off their places on the robot's map. A relocation succeeds if the candle stands upright on the
right table, out of the hand, a second after the robot has finished.

Arrived: the base's centre is within 6 mm of where it grasps (or lets go) and slower than 3 cm/s. Its heading does not
count: what is left of a turn then adds to the time that follows. Lifted: the candle's foot is 2 cm above the table.
Clear: the candle is let go and the hand is back far enough for the base to drive.

Beside the figures stand the goals, and those of a prototype: another robot, measured before this project in another
scene.
"""
