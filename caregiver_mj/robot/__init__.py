"""The robot: kinematics, trajectories and skills."""
