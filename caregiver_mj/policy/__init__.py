"""The scripted policy: from observations of a task to actions of the robot."""
