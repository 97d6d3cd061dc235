"""The scripted caregiver as a policy for the tasks: from observations to actions.

It sees the world through the task's observation only: where the toddler, the candles and the robot are. What the
novice did it infers from how the toddler moved; what to protect it asks a `Caregiver`; how, it leaves to the skills.
"""

from __future__ import annotations

import functools
import math
import zlib
from typing import TYPE_CHECKING

import numpy as np

from caregiver_mj.caregivers.caregiver import (
    NOTHING,
    Assessment,
    Caregiver,
    Observation,
    PaperCaregiver,
    make_caregiver,
)
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans import layout
from caregiver_mj.plans.cell_graph import ACTIONS
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.robot.driving import Skill, View, is_child_close
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.retrieval import RetrievalPlanner
from caregiver_mj.robot.skills import Block, Pick, Place, Retrieve, StandAside, stands_on_table

if TYPE_CHECKING:  # dm_control must not be imported before caregiver_mj.house.rendering
    import dm_env
    from dm_control.rl import control

_CLEAR_DISTANCE = 0.05  # metres of a move after which it is clear where the toddler is heading, ...
_LATEST = 0.5  # ... or the share of a novice timestep after which it will not go anywhere any more
_SMALLEST_MOVE = 0.005  # metres; a toddler that has moved less has not tried to
# Moves from a stairwell within which a child that heads for it makes the robot put a candle down early. From farther
# away a toddler seldom goes on; with no such limit the candles end up nearer to it, and all of it does more harm.
_ALARM = 4
_CRUISING_SPEED, _PLACING_TIME = 1.1, 1.5  # m/s with corners and stops, and seconds to put a candle down
_NO_CANDLES, _NO_ORIENTATIONS = np.zeros((0, 3)), np.zeros((0, 4))
# Seconds for which a candidate is passed over after the robot has failed to protect it: three steps of a toddler, in
# which it can do something else and the way may open.
_PASSED_OVER = 5.0
_LEFT_LYING = 60.0  # seconds, the same for a candle that lies where the arm does not get at it


def _episode_number(observation: dict[str, np.ndarray]) -> int:
    """A number that an episode's first observation makes up, as good as a seed."""
    return zlib.crc32(b"".join(np.ascontiguousarray(value).tobytes() for value in observation.values()))


class _Instructed(Caregiver):
    """Does what the observation of a task asks for, instead of looking for danger."""

    def instruct(self, observation: dict[str, np.ndarray]) -> None:
        """Takes in what is asked for in this episode."""
        self._table = NOTHING
        if "goal_stairwell" in observation:
            self._target = int(observation["goal_stairwell"].argmax())
        else:
            self._target = self.stairwell_count + int(observation["goal_candle"].argmax())
            self._table = int(observation["goal_table"].argmax())

    def decide(self, observation: Observation) -> np.ndarray:
        candle = self._target - self.stairwell_count
        done = candle >= 0 and observation.candle_table[0, candle] == self._table
        return np.array([NOTHING if done else self._target])

    def safe_table(self, observation: Observation, candle: np.ndarray) -> np.ndarray:
        return np.array([self._table])


class CaregiverPolicy:
    """The scripted caregiver. Call it with a time step to get an action.

    Attributes:
        interventions: Interventions begun in this episode.
        interventions_done: Interventions completed: a stairwell reached, or a candle put down.
        assessment: The numbers behind the last decision, if the caregiver has such, for a batch of one.
        target: The candidate that is being protected now, or -1.
        activity: What the robot is doing, in words.
    """

    def __init__(self, env: control.Environment, caregiver: str | Caregiver = "paper", seed: int = 0):
        """Prepares a caregiver for a task.

        Args:
            env: An environment of this package, with the robot in it.
            caregiver: Name of a caregiver, or one made for the environment's house.
            seed: Seed of the caregiver.

        Raises:
            CaregiverError: There is no robot in the environment, or no caregiver of that name.
        """
        task = env.task
        if not task.has_robot:
            raise CaregiverError("there is no robot in this environment for a caregiver to act with")
        self.plan: FloorPlan = task.plan
        if not isinstance(caregiver, str):
            self._caregiver: Caregiver | None = caregiver
        elif task.goal_given:
            self._caregiver = _Instructed(self.plan)
        else:
            self._caregiver = make_caregiver(caregiver, self.plan, seed)
        self._timestep = env.control_timestep()
        self._novice_timestep = task.novice_timestep
        self._robot = RobotMotion(find_embodiment(), self._timestep)
        self._navigator = Navigator(self.plan)
        self._retrievals = RetrievalPlanner(self._navigator)
        self._tables = layout.table_rectangles(self.plan)
        self._stairwells = len(self.plan.stairwells)
        self.interventions = self.interventions_done = 0
        self._next_cell = self.plan.graph.moves[0]

    def __call__(self, timestep: dm_env.TimeStep) -> np.ndarray:
        """Answers an observation with an action (11,).

        Raises:
            CaregiverError: The observation is flat; the caregiver needs its keys.
        """
        observation = timestep.observation
        if "base_position" not in observation:
            raise CaregiverError("the caregiver needs the observation as a dictionary, not flattened")
        if timestep.first():
            self._reset(observation)
        view = self._look(observation)
        new_move = self._watch(view, float(observation["clock"]))
        self._act(view, new_move)
        self._robot.gentle = is_child_close(view)
        action = self._robot.action(view.base)
        self._robot.now += self._timestep
        return action

    # -- Seeing ----------------------------------------------------------------------------------

    def _reset(self, observation: dict[str, np.ndarray]) -> None:
        self._robot.reset(observation["base_position"].tolist())
        if self._caregiver:
            # A caregiver that acts at random does so differently in every episode, and alike in the same one.
            self._caregiver.reset(1, [_episode_number(observation)])
        if isinstance(self._caregiver, _Instructed):
            self._caregiver.instruct(observation)
        self.interventions = self.interventions_done = 0
        self.assessment: Assessment | None = None
        self.target = NOTHING
        self.activity = "watch"
        self._skill: Skill | None = None
        self._reached = False  # the stairwell that it blocks
        self._holding = NOTHING
        self._passed_over_until = np.zeros(self._stairwells + len(self.plan.candle_tables))
        self._begun, self._is_clear = 0, False
        self._origin = tuple(observation["toddler_position"][:2].tolist())
        self._cell = self._free_cell(self._origin)
        self._previous = (self._cell, NOTHING)

    def _look(self, observation: dict[str, np.ndarray]) -> View:
        base = observation["base_position"].tolist()
        child = observation["toddler_position"].tolist()
        velocity = observation["toddler_velocity"].tolist()
        left, right = observation["finger_position"].tolist()
        return View(
            now=self._robot.now,
            base=tuple(base),
            fingers=left + right,
            arm=observation["arm_position"],
            child=(child[0], child[1]),
            child_velocity=(velocity[0], velocity[1]),
            candles=observation.get("candle_position", _NO_CANDLES),
            candle_orientations=observation.get("candle_orientation", _NO_ORIENTATIONS),
        )

    def _watch(self, view: View, clock: float) -> bool:
        """Follows the toddler; returns whether it has just become clear what its present move is.

        A few centimetres show where it is heading, and the floor plan tells whether it will get there or bump into
        something: cell and action are those that the grid would have after this move.
        """
        move = math.floor(clock + 1e-6)
        if move != self._begun:
            self._begun, self._origin, self._is_clear = move, view.child, False
        if self._is_clear:
            return False
        dx, dy = view.child[0] - self._origin[0], view.child[1] - self._origin[1]
        distance = math.hypot(dx, dy)
        if distance < _CLEAR_DISTANCE and clock - move < _LATEST:
            return False
        self._is_clear = True
        cell, action = self._free_cell(self._origin), NOTHING
        self._cell = cell
        if distance > _SMALLEST_MOVE:
            action = max(range(len(ACTIONS)), key=lambda a: dx * ACTIONS[a][1] - dy * ACTIONS[a][0])
            self._cell = int(self._next_cell[cell, action])
        self._previous = (cell, action)
        return True

    def _free_cell(self, position: tuple[float, float]) -> int:
        """Index of the free cell at, or nearest to, a position."""
        index = self.plan.cell_index.get(self.plan.cell_at(np.array(position)))
        if index is not None and index < len(self.plan.free_cells):
            return index
        return min(
            range(len(self.plan.free_cells)),
            key=lambda i: math.dist(self.plan.position(self.plan.free_cells[i]), position),
        )

    def _observation(self, view: View) -> Observation:
        """The world as the caregiver knows it."""
        tables, cells = self._candle_places(view)
        return Observation(
            novice_cell=np.array([self._cell]),
            previous_cell=np.array([self._previous[0]]),
            previous_action=np.array([self._previous[1]]),
            caregiver_cell=np.array([self.plan.cell_index[self._navigator.nearest_cell(view.base[:2])]]),
            candle_table=tables[None],
            holding=np.array([self._holding]),
            candle_cell=cells[None],
            out_of_reach=(self._passed_over_until > view.now)[None],
        )

    def _candle_places(self, view: View) -> tuple[np.ndarray, np.ndarray]:
        """On which table, or on which free cell's floor, each candle is; NOTHING for on none: (candles,) each."""
        if not len(view.candles):
            return np.zeros((2, 0), int)
        offset = view.candles[:, None, :2] - self._tables[:, :2]  # (candles, tables, 2)
        over = (np.abs(offset) < layout.TABLE_HALF_SIZE).all(axis=2)
        on_table = over.any(axis=1) & (view.candles[:, 2] > layout.TABLE_HEIGHT / 2)
        tables = np.where(on_table, over.argmax(axis=1), NOTHING)
        cells = np.full(len(tables), NOTHING)
        for i in np.flatnonzero(~on_table):
            cells[i] = self._free_cell(tuple(view.candles[i, :2].tolist()))
        if self._holding != NOTHING:
            tables[self._holding] = cells[self._holding] = NOTHING
        return tables, cells

    # -- Deciding and acting ---------------------------------------------------------------------

    def _act(self, view: View, new_move: bool) -> None:
        if new_move and self._skill:
            self._skill.replan()
        first = view.now == 0.0
        if new_move or first or self._skill is None:
            seen = self._observation(view)
            self._decide(view, seen, observed=new_move)
        if self._skill is None:
            return
        if self._skill.step(view, self._robot):
            self._finish(view)

    def _decide(self, view: View, seen: Observation, observed: bool) -> None:
        """Asks the caregiver what to protect, and sets about it unless the robot's hands are full."""
        if self._caregiver is None:
            return
        if observed:
            self._caregiver.watch(seen)
        if isinstance(self._caregiver, PaperCaregiver):
            self.assessment = self._caregiver.assess(seen)
        if self._skill is not None and not self._skill.interruptible:
            return
        if self._holding != NOTHING:
            if isinstance(self._skill, Place):
                self._hurry(seen)
            return
        target = int(self._caregiver.decide(seen)[0])
        if target == NOTHING or seen.out_of_reach[0, target]:
            if self._skill is None:
                self._skill, self.activity = StandAside(self._navigator), "keep out of the way"
            return
        if target != self.target or self._skill is None:
            self._begin(target, view, seen)

    def _begin(self, target: int, view: View, seen: Observation) -> None:
        """Begins the intervention that protects a candidate."""
        if target < self._stairwells:
            skill: Skill = Block(self._navigator, target)
            activity = f"block stairwell {target + 1}"
        else:
            candle = target - self._stairwells
            table = int(seen.candle_table[0, candle])
            if table != NOTHING and stands_on_table(view, candle):
                skill, activity = Pick(self._navigator, candle, table), f"fetch candle {candle + 1}"
            else:
                skill = Retrieve(self._navigator, self._retrievals, candle)
                activity = f"pick up candle {candle + 1}"
        if target != self.target:
            self.interventions += 1
            self._reached = False
        self._skill, self.target, self.activity = skill, target, activity

    def _carry(self, seen: Observation, refused: int = NOTHING) -> None:
        """Takes the candle in the hand to a safe table; from one that it could not be brought to, to another."""
        table = int(self._caregiver.safe_table(seen, np.array([self._holding]))[0])
        if table == refused and not isinstance(self._caregiver, _Instructed):
            bare = set(range(len(self.plan.tables))) - {*seen.candle_table[0].tolist(), refused}
            far = self._caregiver.table_distances[self._cell]
            table = max(sorted(bare), key=lambda other: (self._leads_to(other, seen), far[other]), default=table)
        self._place_on(table)

    def _place_on(self, table: int) -> None:
        self._skill = Place(self._navigator, self._holding, table)
        self.activity = f"carry candle {self._holding + 1} to table {table + 1}"

    def _hurry(self, seen: Observation) -> None:
        """Has the candle in the hand put down earlier if the child could else be at a stairwell before the robot.

        It then goes to the table by way of which the robot is there first. On that one the candle must be farther from
        the child than the stairwell is. For another candle, which is no worse than the one in the hand, it is not
        worth while: that has to be fetched again the sooner.
        """
        target = int(self._caregiver.decide(seen)[0])
        if target == NOTHING or target >= self._stairwells or isinstance(self._caregiver, _Instructed):
            return
        moves = self._caregiver.stairwell_distances[self._cell, target]
        if moves > _ALARM or moves >= self._caregiver.stairwell_distances[seen.previous_cell[0], target]:
            return  # it is far from there, or does not head there
        time_left = moves * self._novice_timestep
        if self._seconds_by_way_of(self._skill.table, target, seen) <= time_left:
            return
        far = self._caregiver.table_distances[self._cell]
        bare = sorted(set(range(len(self.plan.tables))) - set(seen.candle_table[0].tolist()))
        seconds = {table: self._seconds_by_way_of(table, target, seen) for table in bare if far[table] > moves}
        table = min(seconds, key=seconds.get, default=self._skill.table)
        if table != self._skill.table and seconds[table] <= time_left:
            self._place_on(table)

    def _seconds_by_way_of(self, table: int, stairwell: int, seen: Observation) -> float:
        """Roughly how long it takes to put the candle down on a table and to be in a stairwell."""
        to_tables, to_landings = self._walks
        stands = [self.plan.cell_index[cell] for cell in self.plan.free_neighbours(self.plan.tables[table])]
        moves = int(to_tables[table, seen.caregiver_cell[0]]) + int(to_landings[stairwell, stands].min())
        return moves * self.plan.cell_size / _CRUISING_SPEED + _PLACING_TIME

    @functools.cached_property
    def _walks(self) -> tuple[np.ndarray, np.ndarray]:
        """Moves from each caregiver cell to beside each table, and to each landing: (tables or landings, cells)."""
        plan = self.plan
        landings = [plan.cell_index[cell] for cell in plan.stairwells]
        return plan.graph.distances_from(plan.graph.beside(plan.tables)), plan.graph.distances_from(landings)

    def _leads_to(self, table: int, seen: Observation) -> bool:
        """Whether a way that the child leaves open leads to a table."""
        here, child = self.plan.caregiver_cells[seen.caregiver_cell[0]], self.plan.free_cells[seen.previous_cell[0]]
        stands = self.plan.free_neighbours(self.plan.tables[table])
        return any(self._navigator.route(here, stand, (child,)) for stand in stands)

    def _finish(self, view: View) -> None:
        """Takes note of a skill that is done, and goes on to the next."""
        skill = self._skill
        if skill.overtaken:
            self._skill, self._holding, self.target = None, NOTHING, NOTHING
            return
        if skill.failed:
            wait = _LEFT_LYING if isinstance(skill, Retrieve) and skill.out_of_reach else _PASSED_OVER
            self._passed_over_until[self.target] = view.now + wait
        elif isinstance(skill, Block):
            if not self._reached:
                self.interventions_done += 1
                self._reached = True
            return  # goes on standing there
        self._skill = None
        if isinstance(skill, Pick | Retrieve) and not skill.failed:
            self._holding = skill.candle
            self._carry(self._observation(view))
        elif isinstance(skill, Place) and skill.failed:  # it has still got the candle
            self._carry(self._observation(view), refused=skill.table)
        else:
            self.interventions_done += isinstance(skill, Place) and not skill.failed
            self._holding = self.target = NOTHING
