"""The verbs by name."""

from __future__ import annotations

from caregiver_mj.errors import CaregiverError
from caregiver_mj.interventions.block import Block
from caregiver_mj.interventions.idle import DoNothing, StandAside
from caregiver_mj.interventions.relocate import Relocate
from caregiver_mj.interventions.verb import Verb

VERBS: dict[str, Verb] = {verb.name: verb for verb in (Block(), Relocate(), StandAside(), DoNothing())}


def verb_of(name: str) -> Verb:
    """The verb of a name.

    Raises:
        CaregiverError: There is none.
    """
    if name not in VERBS:
        raise CaregiverError(f"no verb '{name}': there are {', '.join(VERBS)}")
    return VERBS[name]
