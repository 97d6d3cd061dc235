"""How the results depend on what the paper leaves open, or what others would have chosen otherwise.

What a collision costs, the reading of P(reach), when an interaction ends, how fast the caregiver is, and whether it
makes room for the child: in the grid on two plans and over a set of generated ones, where the house is the unit of
chance, and speed and yielding in the physical house too. And where the rule is no more than "protect from what is
nearest".
"""
