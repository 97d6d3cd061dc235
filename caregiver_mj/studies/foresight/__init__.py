"""What foresight is worth, and what makes it: in the grid, on houses that nobody tuned.

Two parts. The first reads a run of `caregiver-mj evaluate` over many houses and says how much of the damage that the
rule leaves foresight removes, measured against what the same planner removes that is told the child's goal, and against
the floor.
The second takes foresight apart: each variant lacks something, or has it otherwise. A frontier shows damage against
what the child pays for it.
"""
