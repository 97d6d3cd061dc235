"""What is observed where actions are targets: every key once, with what it is; see `Lookout` for their shapes."""

from __future__ import annotations

OBSERVED_OF_TARGETS = {
    "clock": "share of the episode that is over",
    "child_position": "row and column of each child's cell, as shares of the house's",
    "child_move": "its last move, north, east, south or west, one-hot; all 0 where it made none",
    "caregiver_position": "row and column of the caregiver's cell, likewise",
    "hazard_damage": "what a collision with each hazard costs, over the greatest cost there is",
    "hazard_nearness_to_child": "1 over the moves until each child would run into each hazard; 0 if it cannot",
    "hazard_nearness_to_caregiver": "1 over one more than the caregiver's moves to where it does something about it",
    "holding": "the candle in its hand, one-hot",
    "under_way": "the action that it is carrying out, one-hot",
    "action_mask": "which actions do something",
}
