"""A child that learns: alone, with a caregiver, and when the caregiver leaves.

The paper ends on a robot or a child that, better protected, can learn more. Here the novice is a tabular Q-learner in
the grid: toys are its reward, damage is its punishment. It grows up alone or with a caregiver, which leaves it in the
end. What it brings home, what it suffers, how much of the house it sees and what it knows of danger are followed from
episode to episode.
"""
