"""The state of the grid, and the verbs that change it."""

from __future__ import annotations

import abc

import numpy as np

from caregiver_mj.interventions import verb
from caregiver_mj.interventions.verb import Interventions
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING, State, Where
from caregiver_mj.plans.routes import ASIDE, STAY
from caregiver_mj.plans.visibility import lookouts


class GridState:
    """The state of B episodes with K children each."""

    plan: FloorPlan  #: the house
    timestep: int  #: novice timesteps done
    child_cell: np.ndarray  #: free cell of each child, (B, K)
    goal: np.ndarray  #: toy bin of each child, (B, K)
    bumped: np.ndarray  #: whether each child's last move left it in its cell, (B, K)
    previous_cell: np.ndarray  #: cell before each child's last move, (B, K)
    previous_action: np.ndarray  #: that move, or NOTHING, (B, K)
    caregiver_cell: np.ndarray  #: the caregiver's cell, (B,)
    time_left: np.ndarray  #: share of the timestep that the caregiver has left, (B,)
    candle_table: np.ndarray  #: table of each candle, or NOTHING, (B, candles)
    holding: np.ndarray  #: candle in the caregiver's hand, or NOTHING, (B,)
    state: np.ndarray  #: `State` of each hazard, (B, hazards)
    orders: Interventions  #: current interventions
    done: np.ndarray  #: whether the intervention has been counted as done, (B,)

    def forget_orders(self, which: np.ndarray) -> None:
        """End the interventions of some worlds, (n,)."""
        mask = np.zeros(len(self.holding), bool)
        mask[which] = True
        self.orders = Interventions.idle(len(mask)).where(mask, self.orders)


class GridVerb(abc.ABC):
    """The grid's half of a verb, without state."""

    def places(self, plan: FloorPlan) -> list[list[int]]:
        """Return the places of action: groups of caregiver cells, any of which will do."""
        return []

    @abc.abstractmethod
    def place(self, world: GridState, which: np.ndarray) -> np.ndarray:
        """Return the place of action of some worlds, (n,): indices into `places`, ASIDE or STAY."""

    def carry_out(self, world: GridState, which: np.ndarray, came: np.ndarray, stood: np.ndarray) -> np.ndarray:
        """Apply the verb in some worlds, (n,), after the caregiver's move; return whether it is done, (n,).

        The caregiver is at the place of action if it `came`. If it `stood` there before the move, this action is free
        to use, (n,) each.
        """
        return came


class InOpening(GridVerb):
    """Done when the caregiver stands in the opening."""

    def places(self, plan: FloorPlan) -> list[list[int]]:
        return [[plan.cell_index[cell]] for cell in plan.landings]

    def place(self, world: GridState, which: np.ndarray) -> np.ndarray:
        return world.plan.hazards.among(Where.OPENING, world.orders.hazard[which])


class ClosingGate(GridVerb):
    """Done by an action before the gate."""

    def places(self, plan: FloorPlan) -> list[list[int]]:
        return [[plan.cell_index[cell]] for cell in plan.mouths.values()]

    def place(self, world: GridState, which: np.ndarray) -> np.ndarray:
        return world.plan.hazards.among(Where.OPENING, world.orders.hazard[which]) - len(world.plan.landings)

    def carry_out(self, world: GridState, which: np.ndarray, came: np.ndarray, stood: np.ndarray) -> np.ndarray:
        return stood


class PickingUp(GridVerb):
    """Done by an action in the cell of a thing that is still there."""

    def places(self, plan: FloorPlan) -> list[list[int]]:
        return [[cell] for cell in plan.floor_cells]

    def place(self, world: GridState, which: np.ndarray) -> np.ndarray:
        return world.plan.hazards.among(Where.FLOOR, world.orders.hazard[which])

    def carry_out(self, world: GridState, which: np.ndarray, came: np.ndarray, stood: np.ndarray) -> np.ndarray:
        return stood & (world.state[which, world.orders.hazard[which]] == State.AS_PLANNED)


class Relocating(GridVerb):
    """Done when a thing from a table is put down on another one.

    The destination is the one at the time of taking it: decisions are deferred until it is put down.
    """

    def places(self, plan: FloorPlan) -> list[list[int]]:
        return plan.graph.beside(plan.tables)

    def place(self, world: GridState, which: np.ndarray) -> np.ndarray:
        table = world.candle_table[which, world.plan.hazards.among(Where.ON_TABLE, world.orders.hazard[which])]
        return np.where(world.holding[which] == NOTHING, table, world.orders.destination[which])

    def carry_out(self, world: GridState, which: np.ndarray, came: np.ndarray, stood: np.ndarray) -> np.ndarray:
        here = which[stood]
        candle = world.plan.hazards.among(Where.ON_TABLE, world.orders.hazard[here])
        held = world.holding[here] != NOTHING
        world.candle_table[here, candle] = np.where(held, world.orders.destination[here], NOTHING)
        world.holding[here] = np.where(held, NOTHING, candle)
        world.forget_orders(here[held])  # another relocation of this candle would be a new intervention
        put_down = stood.copy()
        put_down[stood] = held
        return put_down


class Looking(GridVerb):
    """Done when the caregiver stands at the lookout."""

    def places(self, plan: FloorPlan) -> list[list[int]]:
        return [[cell] for cell in lookouts(plan)]

    def place(self, world: GridState, which: np.ndarray) -> np.ndarray:
        return world.orders.destination[which]


class Idle(GridVerb):
    """Never done."""

    def place(self, world: GridState, which: np.ndarray) -> np.ndarray:
        return np.full(len(which), ASIDE)

    def carry_out(self, world: GridState, which: np.ndarray, came: np.ndarray, stood: np.ndarray) -> np.ndarray:
        return np.zeros(len(which), bool)


class Waiting(Idle):
    """Waits in its cell, or goes to another and waits there; never done."""

    def places(self, plan: FloorPlan) -> list[list[int]]:
        return [[cell] for cell in range(len(plan.caregiver_cells))]

    def place(self, world: GridState, which: np.ndarray) -> np.ndarray:
        cell = world.orders.destination[which]
        return np.where(cell == NOTHING, STAY, cell)


GRID_VERBS: dict[str, GridVerb] = {
    verb.BLOCK: InOpening(),
    verb.CLOSE: ClosingGate(),
    verb.RELOCATE: Relocating(),
    verb.PICK_UP: PickingUp(),
    verb.LOOK: Looking(),
    verb.STAND_ASIDE: Idle(),
    verb.DO_NOTHING: Waiting(),
}
