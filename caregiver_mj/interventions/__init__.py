"""Interventions of a caregiver against hazards."""
