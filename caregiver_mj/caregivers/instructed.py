"""Caregivers that follow orders: from a task with a goal, from commands, or from a policy over targets."""

from __future__ import annotations

import abc
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver, check_numbers
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.caregivers.target_observation import Encoder, Observations, Places, Slots
from caregiver_mj.interventions.verb import RELOCATE, Intervention
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, Where
from caregiver_mj.registry import errors_of


class InstructedCaregiver(Caregiver):
    """Carries out one order, in one world at a time.

    Attributes:
        orders: The intervention to do.
    """

    takes_orders = True
    orders = Intervention()

    def choose(self, percept: Percept) -> np.ndarray:
        candle = self.plan.hazards.among(Where.ON_TABLE, self.orders.hazard)
        done = self.orders.verb == RELOCATE and percept.candle_table[0, candle] == self.orders.destination
        return np.array([NOTHING if done else self.orders.hazard])

    def destination(self, percept: Percept, candle: np.ndarray) -> np.ndarray:
        return np.array([self.orders.destination])


class CommandedCaregiver(Caregiver):
    """Protects the children from commanded hazards as long as it can do something about them.

    Attributes:
        targets: Number of the hazard in each world, or NOTHING, (B,).
    """

    targets = np.array([NOTHING])

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        self.targets = np.full(batch, NOTHING)

    def choose(self, percept: Percept) -> np.ndarray:
        worth = self.worth_protecting(percept)
        worth = np.column_stack([worth, np.ones(len(worth), bool)])  # last: NOTHING
        return np.where(worth[np.arange(len(worth)), self.targets], self.targets, NOTHING)


class TargetPolicy(CommandedCaregiver, abc.ABC):
    """Base class of policies that choose a target once a novice timestep, in the grid and in the house.

    Observations, masks and actions are those of the Gymnasium environment `caregiver_mj/Supervise-Targets-v0`, for B
    worlds at once. A subclass sets the options with which it was trained.

    Attributes:
        observation: Kind of observation, as `make_targets` takes it, and so `slots` and `shape`.
        encoder: Makes the observations, from `reset` on.
    """

    slots: Places | None = None
    shape: Sequence[int] | None = None
    observation = "numbers"

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        Slots(plan, self.slots, self.shape)  # raises if there are too few

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        super().reset(batch, seeds, children)
        self.encoder = Encoder(self, children, self.observation, self.slots, self.shape)

    @abc.abstractmethod
    def act(self, observations: Observations, masks: np.ndarray) -> np.ndarray:
        """Choose targets.

        Args:
            observations: A dictionary of arrays (B, ...), or one array (B, numbers).
            masks: Whether each action has an effect, bool (B, actions); others count as 0.

        Returns:
            Actions (B,): 0 for nothing, else 1 plus the number of a slot: stairwells, then things to carry, then things
            on the floor.
        """

    def watch(self, percept: Percept) -> None:
        self.encoder.trace.appendleft(percept.previous_cell)
        observations, mask = self.encoder.look(percept)
        who, last = f"{type(self).__name__}.act", self.encoder.actions - 1
        sizes = f"{last} slots and {percept.child_cell.shape[1]} children"
        with errors_of(who, f"in house '{self.plan.name}', which has {sizes} (is it a policy for others?)"):
            actions = self.act(observations, mask.astype(bool))
        actions = check_numbers(f"{who} must answer with", actions, len(mask), 0, last)
        self.targets = self.encoder.slots.targets(actions, len(mask))
