"""The house's robot, watched from outside: what it does with its time."""

from __future__ import annotations

import collections
import math
from typing import Any

from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.robot.motion import RobotMotion
from caregiver_mj.robot.navigation import Navigator
from caregiver_mj.robot.skills import Block, Pick, Place, Skill
from caregiver_mj.robot.status import Status
from caregiver_mj.studies.grid_to_house import phases
from caregiver_mj.studies.grid_to_house.phases import FULL_RATE, PARTS, STOPPED_RATE, action_time

_PHASES = {Block: phases.BLOCK, Pick: phases.FETCH, Place: phases.CARRY}
_ARRIVED = 0.05  # metres from the goal within which a base at rest does not wait for a way


class Watch:
    """Logs what a policy's robot does with its time in one episode.

    Attributes:
        phases: A row a phase: seconds in the grid, in the house, in an empty one and for each of `PARTS`, and how it
            ended.
        seconds: What the whole episode went into.
    """

    def __init__(self, env: Any, policy: CaregiverPolicy, navigator: Navigator):
        """Begins to watch.

        Args:
            env: An environment, at the start of an episode.
            policy: What acts in it.
            navigator: Of its house, to know the ways there are.
        """
        self._physics, self._policy, self._navigator = env.physics, policy, navigator
        self._timestep = env.control_timestep()
        self.phases: list[dict[str, Any]] = []
        self.seconds: collections.Counter[str] = collections.Counter()
        self._skill: Skill | None = None
        self._phase: dict[str, Any] | None = None
        self._done = 0

    def look(self) -> None:
        """Call after every action, before the physics go on."""
        policy, routine = self._policy, self._policy.executive.routine
        skill = routine.skill if routine else None
        if skill is not self._skill:
            self._change(skill)
        if isinstance(skill, Block) and skill.status is Status.DONE:
            self._end(done=True)
        self._done = policy.interventions_done
        if self._phase is None or skill is None:
            self.seconds["guard" if isinstance(skill, Block) else "idle"] += self._timestep
            return
        if self._phase["clear"] is None and skill.driver.goal is not None:
            self._phase["clear"] = self._clear_time(skill)
        part, rate = self._part(skill)
        self._phase[part] += self._timestep
        self._phase["house"] += self._timestep
        self._phase["lost"] += (1 - rate) * self._timestep if part == "slowed" else 0.0

    def finish(self) -> None:
        """Ends the episode."""
        self._end(done=False)

    def _change(self, skill: Skill | None) -> None:
        """Ends the phase of one skill and begins that of the next."""
        before, policy = self._skill, self._policy
        if isinstance(before, Pick):
            self._end(done=policy.executive.holding == before.candle)
        else:
            self._end(done=isinstance(before, Place) and policy.interventions_done > self._done)
        self._skill = skill
        if skill is not None and type(skill) in _PHASES:
            self._begin(skill)

    def _begin(self, skill: Skill) -> None:
        navigator = self._navigator
        start = navigator.nearest_cell(self._physics.base_position()[:2])
        if isinstance(skill, Block):
            goals = [skill.cell]
        else:
            assert isinstance(skill, Pick | Place)
            goals = navigator.plan.free_neighbours(navigator.plan.tables[skill.table])
        routes = [route for goal in goals if (route := navigator.route(start, goal)) is not None]
        actions = min(len(route) - 1 for route in routes) + (not isinstance(skill, Block))
        self._phase = dict.fromkeys(("house", "lost", *PARTS), 0.0)
        self._phase |= {"phase": _PHASES[type(skill)], "grid": actions * action_time(navigator.plan), "clear": None}

    def _end(self, done: bool) -> None:
        phase = self._phase
        if phase is None or self._skill is None:
            return
        phase["end"] = phases.DONE if done else phases.FAILED if self._skill.status.failed else phases.GIVEN_UP
        if phase["clear"] is None:
            phase["clear"] = math.nan if phase["house"] else 0.0  # 0: it was there already
        self.seconds[phase["phase"] if done else "unfinished"] += phase["house"]
        self.phases.append(phase)
        self._phase = None

    def _clear_time(self, skill: Skill) -> float:
        """Seconds that the base would drive if there were no child, from rest."""
        x, y, yaw = self._physics.base_position()
        goal, cell = skill.driver.goal, skill.driver.cell
        assert goal is not None
        assert cell is not None
        points = self._navigator.path((x, y), goal, cell)
        if points is None:
            return math.nan
        motion = RobotMotion(self._policy.robot.robot, self._timestep)
        motion.reset((x, y, yaw))
        motion.drive_along(points, self._navigator.clearance.has_room)
        return motion.time_left

    def _part(self, skill: Skill) -> tuple[str, float]:
        """What this timestep is for, and the share of its planned speed at which the base drives."""
        robot, driver = self._policy.robot, skill.driver
        if not skill.is_approaching:
            return "hand", 1.0
        if driver.stands_aside(robot.now):
            return "aside", 1.0
        if not robot.is_driving:
            off = math.dist(driver.goal, self._physics.base_position()[:2]) if driver.goal else 0.0
            return ("hand", 1.0) if off < _ARRIVED else ("stopped", 0.0)
        rate = robot.rate
        return "full" if rate >= FULL_RATE else "slowed" if rate >= STOPPED_RATE else "stopped", rate
