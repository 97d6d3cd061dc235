"""The caregivers by name, and policies of one's own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeGuard

from caregiver_mj.caregivers import remote
from caregiver_mj.caregivers.baselines import (
    ChildproofCaregiver,
    GuardCaregiver,
    NearestCaregiver,
    NearestFirstCaregiver,
    RandomCaregiver,
    WandererCaregiver,
)
from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver, KnowsGoalCaregiver
from caregiver_mj.caregivers.instructed import CommandedCaregiver
from caregiver_mj.caregivers.learned import LearnedCaregiver
from caregiver_mj.caregivers.paper import CandlesCaregiver, LastSeenCaregiver, PaperCaregiver, StairsCaregiver
from caregiver_mj.caregivers.server import SCHEMES, Queries
from caregiver_mj.errors import CaregiverError, check_integer, check_kind
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.registry import Registry, check_call, errors_of, named_object

PolicyMaker = Callable[[Any], Any]  # of an environment, a policy: from a time step to an action of the robot

CAREGIVERS: Registry[type[Caregiver] | None] = Registry(
    "caregiver",
    "caregiver_mj.caregivers",
    "caregiver_mj.caregivers.caregiver.Caregiver",
    {
        "none": None,
        "random": RandomCaregiver,
        "nearest": NearestCaregiver,
        "guard": GuardCaregiver,
        "expected-danger": PaperCaregiver,
        "paper": PaperCaregiver,  # an alias, and what the rows of earlier runs have
        "last-seen": LastSeenCaregiver,
        "stairs": StairsCaregiver,
        "candles": CandlesCaregiver,
        "wanderer": WandererCaregiver,
        "nearest-first": NearestFirstCaregiver,
        "childproof": ChildproofCaregiver,
        "foresight": ForesightCaregiver,
        "learned": LearnedCaregiver,
        "knows-goal": KnowsGoalCaregiver,
    },
)


class _Policies(Registry[Any]):
    def check(self, name: str, value: str, found: Any) -> None:
        _check(f"{self.what} '{name}' ({value})", found)


# In the place of a caregiver: somebody who plays it in a viewer, by what to do or by how to drive.
PLAYERS = PERSON, DRIVER = "person", "driver"
RULE = ("expected-danger", "paper")  # the names of the paper's own caregiver

POLICIES: Registry[Any] = _Policies("policy", "caregiver_mj.policies", "", {})


def find_caregiver(
    name: str, others: Sequence[str] = (), queries: Queries = Queries()
) -> type[Caregiver] | PolicyMaker | None:
    """Find a caregiver's class by name, or what makes a policy of the robot's actions; None for "none".

    Args:
        name: One of `CAREGIVERS` or `POLICIES`, or where such a thing is, as `module:object`; or whom to ask, see
            `remote_caregiver`.
        others: What else may be said in the place of a name, for the message that there is none.
        queries: How it is asked, if it is elsewhere.

    Raises:
        CaregiverError: There is none of that name, or it cannot be loaded.
    """
    check_kind("the name of a caregiver", name, str)
    if name.startswith(SCHEMES):
        return remote.remote_caregiver(name, queries)
    if name == PERSON:
        return CommandedCaregiver
    if name == DRIVER:
        return named_object("caregiver_mj.policy.own:Teleoperation")  # with MuJoCo, which the grid does without
    if name in CAREGIVERS:
        POLICIES.tell_of_namesakes(name, f"there is a caregiver '{name}'")
        return CAREGIVERS[name]
    if name in POLICIES:
        return POLICIES[name]
    if ":" not in name:
        known = ", ".join(dict.fromkeys([*CAREGIVERS, *POLICIES, *others]))
        raise CaregiverError(f"no caregiver '{name}': there are {known}, and yours as module:object")
    found = named_object(name)
    _check(f"'{name}'", found)
    return found


def check_acts_alone(name: str) -> None:
    """Raise CaregiverError if it is a person or driver, who would stand aside wherever nobody plays."""
    if name in PLAYERS:
        raise CaregiverError(f"caregiver must be one that acts by itself: a {name} plays in `caregiver-mj view`")


def is_caregiver(found: type[Caregiver] | PolicyMaker) -> TypeGuard[type[Caregiver]]:
    """Return whether it is a caregiver's class."""
    return isinstance(found, type) and issubclass(found, Caregiver)


def needs_pictures(name: str, queries: Queries = Queries()) -> bool:
    """Return whether one of that name looks through cameras: its class, or maker, has `needs_pictures = True`."""
    return bool(getattr(find_caregiver(name, queries=queries), "needs_pictures", False))


def _check(what: str, found: Any) -> None:
    """Raise CaregiverError unless it can be a caregiver or make a policy."""
    chooses = isinstance(found, type) and not {"choose", "decide"}.isdisjoint(dir(found))  # as a caregiver does
    if not callable(found) or (chooses and not is_caregiver(found)):
        raise CaregiverError(
            f"{what} must be a subclass of Caregiver or a function that makes a policy of an environment, got {found!r}"
        )


def make_caregiver(name: str, plan: FloorPlan, seed: int = 0, queries: Queries = Queries()) -> Caregiver | None:
    """Make a caregiver by name, as of `find_caregiver`; "none" gives None. The queries say how it asks if it is remote.

    Raises:
        CaregiverError: There is none of that name, it cannot be loaded or made, or is a policy of the robot's actions.
    """
    check_kind("the house of a caregiver", plan, FloorPlan)
    check_integer("the seed of a caregiver", seed, 0)
    maker = find_caregiver(name, queries=queries)
    if maker is None:
        return None
    if not is_caregiver(maker):
        raise CaregiverError(
            f"caregiver must be a subclass of Caregiver, got '{name}', a policy: it acts in the house only"
        )
    check_call(f"caregiver '{name}'", maker, plan, seed)
    with errors_of(f"caregiver '{name}'", "as it was made"):
        return maker(plan, seed)
