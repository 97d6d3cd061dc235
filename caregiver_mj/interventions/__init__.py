"""Interventions: what a caregiver can do about a hazard, one module a verb."""
