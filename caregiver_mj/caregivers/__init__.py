"""Caregivers: what to protect next."""

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.instructed import TargetPolicy
from caregiver_mj.caregivers.percept import Assessment, Percept
from caregiver_mj.caregivers.registry import CAREGIVERS, make_caregiver

__all__ = ["CAREGIVERS", "Assessment", "Caregiver", "Percept", "TargetPolicy", "make_caregiver"]
