"""Models of the robot, the toddler and the house, and the floor plans."""
