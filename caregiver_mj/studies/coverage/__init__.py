"""How often 95 % intervals cover the truth.

Samples are drawn, again and again, from so many episodes of the grid world that their mean may pass for the truth.
Prints docs/coverage.md; with --docs writes it and its figure.
"""
