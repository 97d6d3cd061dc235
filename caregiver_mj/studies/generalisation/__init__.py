"""What a caregiver that has learnt elsewhere, or that watches a child that changes, is worth.

The paper's future work: "generalizing known expert policies to novel tasks, environments, and agent configurations".
Experts of other houses, by what was around them, are set against experts in place and none at all; and `foresight`,
which believes that a child's epsilon may change, is tried on children whose epsilon or toy bins do.
"""
