"""Runs of many episodes, with statistics, verdicts and submissions."""
