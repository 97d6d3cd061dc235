"""For how long a child stands in the only way, so that the robot cannot go on whatever it does."""

from __future__ import annotations

from caregiver_mj.house.physics import Physics
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot.routes import Routes


class Barred:
    """The ways to one table after the other, in one relocation.

    Attributes:
        seconds: For how long none of them has been open.
    """

    def __init__(self, physics: Physics, plan: FloorPlan, tables: tuple[int, int], control_timestep: float):
        """Begins to count.

        Args:
            physics: Of the house.
            plan: Its floor plan.
            tables: The table that a candle is taken from, and the one it is brought to.
            control_timestep: Seconds between two looks.
        """
        self._physics, self._routes, self._timestep = physics, Routes(plan), control_timestep
        self._stands = [plan.free_neighbours(plan.tables[table]) for table in tables]
        self.seconds = 0.0

    def look(self) -> None:
        """Call at every control timestep."""
        routes, physics = self._routes, self._physics
        here = routes.nearest_cell(tuple(physics.base_position()[:2].tolist()))
        children = {routes.plan.cell_at(child) for child in physics.toddler_positions()[:, :2].tolist()}
        stands = self._stands[physics.is_gripping()]
        if here not in stands and all(routes.route(here, stand, children) is None for stand in stands):
            self.seconds += self._timestep
