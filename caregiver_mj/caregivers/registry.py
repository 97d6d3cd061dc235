"""The caregivers by name."""

from __future__ import annotations

from caregiver_mj.caregivers.baselines import GuardCaregiver, NearestCaregiver, RandomCaregiver
from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.childproof import ChildproofCaregiver
from caregiver_mj.caregivers.foresight.clairvoyant import ClairvoyantCaregiver
from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver
from caregiver_mj.caregivers.foresight.knows_goal import KnowsGoalCaregiver
from caregiver_mj.caregivers.paper import (
    PaperAlikeCaregiver,
    PaperCaregiver,
    PaperMaxAlikeCaregiver,
    PaperMaxCaregiver,
)
from caregiver_mj.caregivers.parts import CandlesCaregiver, PaperStillCaregiver, StairsCaregiver
from caregiver_mj.caregivers.predictive import PaperPredictiveCaregiver
from caregiver_mj.caregivers.wanderer import WandererCaregiver
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.registry import Registry

CAREGIVERS: Registry[type[Caregiver]] = Registry(
    "caregiver",
    "caregiver_mj.caregivers",
    "caregiver_mj.caregivers.caregiver.Caregiver",
    {
        "none": None,
        "random": RandomCaregiver,
        "nearest": NearestCaregiver,
        "guard": GuardCaregiver,
        "paper": PaperCaregiver,
        "paper-max": PaperMaxCaregiver,
        "paper-alike": PaperAlikeCaregiver,
        "paper-max-alike": PaperMaxAlikeCaregiver,
        "paper-predictive": PaperPredictiveCaregiver,
        "paper-still": PaperStillCaregiver,
        "stairs": StairsCaregiver,
        "candles": CandlesCaregiver,
        "wanderer": WandererCaregiver,
        "childproof": ChildproofCaregiver,
        "foresight": ForesightCaregiver,
        "knows-goal": KnowsGoalCaregiver,
        "clairvoyant": ClairvoyantCaregiver,
    },
)


def make_caregiver(name: str, plan: FloorPlan, seed: int = 0) -> Caregiver | None:
    """Makes a caregiver by name; "none" gives None.

    Raises:
        CaregiverError: There is none of that name, or another package's cannot be loaded.
    """
    maker = CAREGIVERS[name]
    return maker(plan, seed) if maker else None
