"""Caregivers that no user has, to compare others with. `PYTHONPATH=scripts/studies/bounds` has them found by name."""
