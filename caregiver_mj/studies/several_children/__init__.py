"""Two children at once: what a caregiver leaves of the damage, and whether P(safe) helps it to choose between them.

With one child the factor 1 - P(safe) of equation (2) cancels. With two it says whom to attend to. So the rule is set
against itself without the factor, and either way with the sum of the dangers to both children and with the greatest,
in the same episodes.
"""
