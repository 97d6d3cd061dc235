"""The scripted policy: from a task's observations to the robot's actions."""
