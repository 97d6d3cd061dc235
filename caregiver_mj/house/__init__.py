"""The physical house: its scene and its simulation."""

import caregiver_mj.house.rendering  # noqa: F401 (it imports MuJoCo and dm_control without OpenGL)
