"""The registries of caregivers and policies."""

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
    attentive,
)
from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver, KnowsGoalCaregiver
from caregiver_mj.caregivers.instructed import CommandedCaregiver
from caregiver_mj.caregivers.learned import LearnedCaregiver
from caregiver_mj.caregivers.paper import CandlesCaregiver, LastSeenCaregiver, PaperCaregiver, StairsCaregiver
from caregiver_mj.caregivers.server import SCHEMES, Queries
from caregiver_mj.errors import CaregiverError, check_integer, check_kind, check_number
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.registry import Registry, check_call, errors_of, named_object

PolicyMaker = Callable[[Any], Any]  # environment -> policy, a function from a time step to an action

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
        "paper": PaperCaregiver,  # alias, in rows of earlier runs
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


# Human players in a viewer: one chooses hazards, the other drives the robot.
PLAYERS = PERSON, DRIVER = "person", "driver"
RULE = ("expected-danger", "paper")  # names of the paper's caregiver
ATTENTIVE = "attentive:"  # prefix of SHARE or SHARE:NAME, share of the time that it looks

POLICIES: Registry[Any] = _Policies("policy", "caregiver_mj.policies", "", {})


def find_caregiver(
    name: str, others: Sequence[str] = (), queries: Queries = Queries()
) -> type[Caregiver] | PolicyMaker | None:
    """Find a caregiver's class by name, or the maker of a policy of robot actions; None for "none".

    Args:
        name: One of `CAREGIVERS` or `POLICIES`, `module:object` for another, an address, see `remote_caregiver`, or
            `attentive:SHARE` or `attentive:SHARE:NAME` for one that looks only for a share of the time.
        others: Further valid names, for error messages.
        queries: How to query a remote caregiver.

    Raises:
        CaregiverError: The name is unknown, or its code cannot be loaded.
    """
    check_kind("the name of a caregiver", name, str)
    if name.startswith(SCHEMES):
        return remote.remote_caregiver(name, queries)
    if name.startswith(ATTENTIVE):
        return _attentive(name)
    if name in PLAYERS:  # the driver imports MuJoCo, which the grid does not need
        return CommandedCaregiver if name == PERSON else named_object("caregiver_mj.policy.own:Teleoperation")
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


def inner_name(name: str) -> str:
    """Return the name of an attentive caregiver's inner one; any other name unchanged."""
    return (name.removeprefix(ATTENTIVE).partition(":")[2] or RULE[0]) if name.startswith(ATTENTIVE) else name


def _attentive(name: str) -> type[Caregiver]:
    share, other = name.removeprefix(ATTENTIVE).partition(":")[0], inner_name(name)
    try:
        looks = float(share)
    except ValueError:
        raise CaregiverError(f"caregiver must be attentive:SHARE or attentive:SHARE:NAME, got '{name}'") from None
    check_number("the share of attention", looks, 0.0, 1.0)
    found = None if other in PLAYERS or other.startswith((*SCHEMES, ATTENTIVE)) else find_caregiver(other)
    if found is None or not is_caregiver(found):
        raise CaregiverError(
            f"an attentive caregiver must act as one of this machine's that is no player does, got '{other}'"
        )
    return attentive(looks, found)


def check_acts_alone(name: str) -> None:
    """Raise CaregiverError for a human player, who acts in a viewer only."""
    if name in PLAYERS:
        raise CaregiverError(f"caregiver must be one that acts by itself: a {name} plays in `caregiver-mj view`")


def is_caregiver(found: type[Caregiver] | PolicyMaker) -> TypeGuard[type[Caregiver]]:
    """Return whether an object is a caregiver's class."""
    return isinstance(found, type) and issubclass(found, Caregiver)


def needs_pictures(name: str, queries: Queries = Queries()) -> bool:
    """Return whether a caregiver or policy needs camera images: `needs_pictures = True` in its class or maker."""
    return bool(getattr(find_caregiver(name, queries=queries), "needs_pictures", False))


def _check(what: str, found: Any) -> None:
    """Raise CaregiverError unless an object is a caregiver's class or makes a policy."""
    chooses = isinstance(found, type) and not {"choose", "decide"}.isdisjoint(dir(found))  # like a caregiver
    if not callable(found) or (chooses and not is_caregiver(found)):
        raise CaregiverError(
            f"{what} must be a subclass of Caregiver or a function that makes a policy of an environment, got {found!r}"
        )


def make_caregiver(name: str, plan: FloorPlan, seed: int = 0, queries: Queries = Queries()) -> Caregiver | None:
    """Make a caregiver by name, with the arguments of `find_caregiver`; None for "none".

    Raises:
        CaregiverError: The name is unknown, its code fails, or it is a policy of robot actions.
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
