"""Runs of many episodes, and what they show."""
