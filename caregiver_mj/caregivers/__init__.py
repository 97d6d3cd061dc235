"""Caregivers: what to protect next."""
