"""Where children bar the caregiver's only way it keeps a free cell between itself and them."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from random_plans import plan_texts

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.children.tape import Tape
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.cell_graph import UNREACHABLE
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.routes import ASIDE, STAY, Routes

# Cells 0 to 7 from west to east, the landing, cell 8, at the eastern end.
HALL = FloorPlan.parse("###########\n#B.......S#\n###########")
LANDING = 7


def test_behind_a_child_in_a_hall_there_is_a_free_cell():
    routes = Routes(HALL, [[LANDING]])
    distance, next_cell = routes.around(4)
    assert distance[0, :4].tolist() == [UNREACHABLE] * 4
    assert next_cell[0, :4].tolist() == [1, 2, 2, 2]  # from 3, beside the child, it goes back
    assert distance[0, 5:].tolist() == [2, 1, 0]
    assert next_cell[0, 5:].tolist() == [6, 7, 7]


def test_one_that_does_not_yield_stays_where_its_way_is_barred():
    routes = Routes(HALL, [[LANDING]])
    child, here = np.full((3, 1), 4), np.array([3, 1, 5])
    assert routes.towards(np.zeros(3, int), child, here, yields=False)[1].tolist() == [3, 1, 6]


def test_who_stays_is_there():
    routes = Routes(HALL, [[LANDING]])
    distance, next_cell = routes.towards(np.array([STAY]), np.array([[4]]), np.array([3]))
    assert (distance.tolist(), next_cell.tolist()) == ([0], [3])


class Wishes(Caregiver):
    """Wants any hazard, or nothing, for a while each."""

    def __init__(self, plan, seed):
        super().__init__(plan)
        self._wishes = np.random.RandomState(seed).randint(-1, len(plan.hazards), 1000)
        self._asked = 0

    def choose(self, percept):
        self._asked += 1
        return np.full(len(percept.child_cell), self._wishes[self._asked // 5])


class Watched(GridWorld):
    """Remembers whether the caregiver last came to where it is while its way was barred."""

    def reset(self, tapes):
        super().reset(tapes)
        self.waits, self.cornered = False, False

    def act_caregiver(self, *args, **kwargs):
        before, towards = self.caregiver_cell.copy(), self._routes.towards
        seen = []

        def watched(place, *rest):
            distance, next_cell = towards(place, *rest)
            seen.append(distance[0] == UNREACHABLE and place[0] not in (ASIDE, STAY))
            return distance, next_cell

        self._routes.towards = watched
        try:
            super().act_caregiver(*args, **kwargs)
        finally:
            del self._routes.towards
        near = self.plan.graph.distances_from([self.child_cell[0].tolist()])[0]
        if (self.caregiver_cell != before).any():
            self.waits = seen[0]
        self.came_beside = self.waits and near[self.caregiver_cell[0]] <= 1 < near[before[0]]


@settings(deadline=None, max_examples=60)
@given(
    plan_texts(largest=12),
    st.lists(st.sampled_from([1.0, 0.5, 0.05]), min_size=1, max_size=3),
    st.integers(0, 10_000),
)
def test_no_child_is_denied_a_move_by_a_caregiver_that_came_into_its_way_while_its_own_was_barred(text, who, seed):
    plan = FloorPlan.parse(text)
    if len(plan.free_cells) <= len(who):
        return
    world = Watched(plan, ",".join(map(str, who)), Wishes(plan, seed))
    world.reset([Tape.draw_family(np.random.RandomState(seed), len(who))])
    for _ in range(60):
        world.move_children()
        for _ in range(3):
            world.act_caregiver(world.caregiver)
            assert not world.came_beside
