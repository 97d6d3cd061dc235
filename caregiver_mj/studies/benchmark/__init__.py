"""How fast everything is: prints tables, and writes the figures as JSON if asked to.

Figures that are to be compared are measured in turn, within one run, and every one is the median of its repeats:
machines and their load differ, ratios much less.
"""
