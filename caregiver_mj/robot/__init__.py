"""The robot: its limits, kinematics, trajectories, path planning and skills. Nothing here knows of danger."""
