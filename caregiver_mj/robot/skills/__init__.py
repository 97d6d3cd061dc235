"""Skills: block, close, go to a cell, stand aside, rest, pick, pick up, retrieve, place.

Each skill is a small state machine over references. Its `step`, called once a control step, looks at a `View`, sets
goals of the `RobotMotion` and returns its `Status`. Skills know tables, candles and cells, but no danger.
"""

from caregiver_mj.robot.skills.at_table import Pick, Place
from caregiver_mj.robot.skills.close import Close
from caregiver_mj.robot.skills.pick_up import PickUp
from caregiver_mj.robot.skills.retrieve import Retrieve
from caregiver_mj.robot.skills.skill import Block, GoTo, Rest, Skill, StandAside

__all__ = ["Block", "Close", "GoTo", "Pick", "PickUp", "Place", "Rest", "Retrieve", "Skill", "StandAside"]
