"""The planner: it predicts the children's moves and chooses the option with the least expected damage to come.

A privileged variant knows the children's goals and epsilons.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver, PrivilegedCaregiver, Truth
from caregiver_mj.caregivers.foresight.motion import Motion, motion
from caregiver_mj.caregivers.foresight.options import Cases, OptionIndex, Options, Sums, first_of_least, regret
from caregiver_mj.caregivers.foresight.value_table import (
    OBJECTIVE,
    Objective,
    Tables,
    ValueTable,
    candles_at_a_time,
    value_tables,
)
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import Assessment, Percept, Prediction, bare_tables
from caregiver_mj.danger.belief import Belief
from caregiver_mj.danger.child_model import CHANGE, EPSILONS, child_chain
from caregiver_mj.interventions.verb import DO_NOTHING, LOOK, STAND_ASIDE, Interventions
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.plans.visibility import ALL_ROUND, lookouts, visibility

# Improvement, as a share of the damage to come, that justifies a change of option; below, the robot turns round for
# trifles. On 34 houses of train-100 and shapes-train-100 .001 was no better (damage by 0.0 %, standard error 0.8 %, 60
# episodes a house), and in 15 tiny houses farther from the optimum at epsilon .05.
HYSTERESIS = 0.004
# Timesteps for which the cost of not seeing a child counts. On six houses of train-100, walls opaque, 20 episodes of
# each novice, 0 closes 76 % of the gap from `last-seen` to full sight; 16, 30 and 60 close 93, 96 and 96 %.
REGRETS = 30


class ForesightCaregiver(Caregiver):
    """Takes the option with the least expected damage, later interventions included.

    It updates a belief over each child's toy bin and epsilon by the child's moves. Expected damages, from a
    `ValueTable`, are averaged by this belief and summed over the children (QMDP: Littman, Cassandra and Kaelbling
    1995). With unseen children it also averages over their cells, and adds the cost of not seeing them (`regret`), so
    that it looks for a child where information is worth more than action.

    A child that moves like none of its models (`Belief.understood`) is left to the rule, equation (2). So is a house
    too large for a table, with P(reach) from the belief.
    """

    def __init__(
        self,
        plan: FloorPlan,
        seed: int = 0,
        *,
        hysteresis: float = HYSTERESIS,
        change: float = CHANGE,
        objective: Objective = OBJECTIVE,
        regrets: int = REGRETS,
    ):
        """Set up the planner; `reset` computes its tables.

        Args:
            plan: The house.
            seed: Seed of the paper's safety model, used for displays and the rule; the planner itself draws nothing.
            hysteresis: Improvement, as a share of the damage to come, that justifies a change of option.
            change: Probability in a timestep that a child's epsilon changes.
            objective: The objective.
            regrets: Timesteps for which the cost of not seeing a child counts (`regret`); 0 to never look for one.
        """
        super().__init__(plan, seed)
        self._plans = candles_at_a_time(plan) >= min(1, len(plan.candle_tables))
        self.waits = self._plans
        self._hysteresis, self._change, self._objective, self._regrets = hysteresis, change, objective, regrets
        self._rule = PaperCaregiver(plan, seed)  # for displays, and for decisions without a plan
        self._begin(1, 1)

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        if self._plans:
            self._values()  # both now, so that no decision waits for them
            self._ways()
        self._rule.reset(batch, seeds, children)
        self._rule.followers = None  # its own belief detects them
        self._begin(batch, children)

    def _begin(self, batch: int, children: int) -> None:
        self.belief = Belief(child_chain(self.plan), batch, children, self._change)
        self._begun, self._table = np.full((2, batch), NOTHING)  # present option, and its destination

    def _values(self) -> Tables:
        return value_tables(self.plan, self.pace, self._objective)

    def _ways(self) -> Motion:
        """Return the motion model, with lookouts if there are any."""
        return motion(self.plan, self.pace, self._lookouts)

    @property
    def index(self) -> OptionIndex:
        """Numbering of its options."""
        plan = self.plan
        things = len(plan.stairwells), len(plan.candle_tables), len(plan.floor_cells)
        return OptionIndex(*things, len(self._lookouts), len(plan.caregiver_cells))

    @property
    def _lookouts(self) -> tuple[int, ...]:
        return () if self.sight.is_full else lookouts(self.plan)

    def watch(self, percept: Percept) -> None:
        if percept.belief:
            self.belief = percept.belief
        else:
            self.belief.watch(percept.previous_cell, percept.previous_action, percept.caregiver_cell)
        self._rule.watch(percept)

    def assess(self, percept: Percept) -> Assessment:
        """Return the belief and the paper's P(safe|tau); P(reach) in equation (2) follows from the belief.

        Decisions follow from `options`, which also count later interventions.
        """
        joint = percept.belief.joint.copy() if percept.belief else None
        prediction = Prediction(child_chain(self.plan), percept.child_cell, self.belief.probability, joint)
        return dataclasses.replace(self._rule.weigh(prediction.reach(self.plan, percept)), prediction=prediction)

    def choose(self, percept: Percept) -> np.ndarray:
        return self.decide(percept).hazard

    def decide(self, percept: Percept) -> Interventions:
        answer = Interventions.idle(len(percept.caregiver_cell))
        lying = self._within_reach_on_the_floor(percept)
        # A candle in the hand is put down first; then one on the floor is picked up.
        empty, index = percept.holding == NOTHING, self.index
        picks = empty & lying.any(axis=1)
        if picks.any():
            candle = lying.argmax(axis=1)
            tables = self.destination(percept, candle)[picks]
            self._order(answer, np.flatnonzero(picks), index.relocations.start + candle[picks], tables)
        free = empty & ~picks
        understood = self.belief.understood.all(axis=1)
        by_rule = free & ~(understood & self._plans)
        if by_rule.any():
            foreseen = self._rule.target(percept, self.assess(percept))
            answer = self.protect(percept, np.where(understood, foreseen, self._rule.choose(percept))).where(
                by_rule, answer
            )
            self._begun[by_rule] = NOTHING
        worlds = np.flatnonzero(free & ~by_rule)
        if worlds.size and len(self.plan.hazards):
            options = self.options(each_on_a_table(self.plan, percept), worlds)
            chosen = self.best(options, percept, worlds)
            here = index.waits.start + percept.caregiver_cell[worlds]
            chosen = np.where(chosen == index.stay, here, chosen)  # to stay is to wait where it is
            candle = index.among(index.relocations, chosen)
            each = np.arange(len(worlds))
            table = options.table[each, candle] if options.table.size else candle
            self._order(answer, worlds, chosen, np.where(candle == NOTHING, NOTHING, table))
        return answer

    def options(self, percept: Percept, worlds: np.ndarray) -> Options:
        """Return the options in some worlds, (W,), in which all candles are on tables."""
        landings = len(self.plan.landings)
        shut = np.zeros((len(worlds), 0), bool) if percept.shut is None else percept.shut[worlds, landings:]
        ways, which = np.unique(shut, axis=0, return_inverse=True)
        tables = [self._values()[frozenset((landings + np.flatnonzero(row)).tolist())] for row in ways]
        parts = [self._options(one, percept, worlds[which.ravel() == way]) for way, one in enumerate(tables)]
        order = np.argsort(np.argsort(which.ravel(), kind="stable"))
        damage = np.concatenate([part.damage for part in parts])[order]
        return Options(damage, np.concatenate([part.table for part in parts])[order])

    def _options(self, values: ValueTable, percept: Percept, worlds: np.ndarray) -> Options:
        """Return the options in worlds with the same gates shut."""
        every = np.arange(len(worlds))
        if not percept.belief:  # all children seen: one case a world
            sums = Sums.zeros(values, values.motion, every, percept, worlds)
            for child, probability in enumerate(np.moveaxis(self.belief.probability[worlds], 1, 0)):
                wants = probability.reshape(len(worlds), -1)[:, values.possible].astype(np.float32)
                sums.add(Cases(every, percept.child_cell[worlds, child], wants))
            return sums.options()
        ways, parts = self._ways(), []
        for belief in np.moveaxis(percept.belief.joint[worlds], 1, 0):
            cases = Cases.likely(belief, values.possible)
            parts.append((cases, Sums.zeros(values, ways, cases.which, percept, worlds)))
            parts[-1][1].add(cases)
        options = functools.reduce(Sums.plus, [sums.by_world(cases) for cases, sums in parts]).options()
        if not self._regrets:
            options.damage[:, self.index.looks.start :] = np.inf
            return options
        seen = visibility(self.plan, self.sight).seen[:, ALL_ROUND]
        options.damage[:] += regret(parts, seen, self._regrets)
        return options

    def expected_damage(self, percept: Percept, worlds: np.ndarray) -> np.ndarray:
        """Return the expected damage to come after a timestep's last action, (W,), with all candles on tables."""
        nothing_left = dataclasses.replace(percept, time_left=np.zeros(len(percept.caregiver_cell)))
        return self.options(nothing_left, worlds).damage.min(axis=1)

    def best(self, options: Options, percept: Percept, worlds: np.ndarray) -> np.ndarray:
        """Return the number of the best option in some worlds, (W,)."""
        damage = options.damage.copy()
        if percept.out_of_reach is not None:
            damage[self.index.of_hazards(percept.out_of_reach[worlds], others=False)] = np.inf
        begun, tables = self._begun[worlds], percept.candle_table[worlds]
        candle = self.index.among(self.index.relocations, begun)
        if tables.size:  # a relocation ends once its candle is at its destination
            there = tables[np.arange(len(worlds)), candle] == self._table[worlds]
            begun = np.where((candle != NOTHING) & there, NOTHING, begun)
        goes_on = np.arange(damage.shape[1]) == begun[:, None]
        return first_of_least(damage - goes_on * self._hysteresis * damage.min(axis=1, keepdims=True))

    def destination(self, percept: Percept, candle: np.ndarray) -> np.ndarray:
        """Return the planned table for the candle if it is bare; else the farthest one."""
        chosen = np.where(self._begun == self.index.relocations.start + candle, self._table, NOTHING)
        bare = bare_tables(percept.candle_table, len(self.plan.tables))[np.arange(len(chosen)), chosen]
        return np.where(bare & (chosen != NOTHING), chosen, super().destination(percept, candle))

    def _order(self, answer: Interventions, worlds: np.ndarray, option: np.ndarray, table: np.ndarray) -> None:
        index = self.index
        hazard, look = index.hazard(option), index.among(index.looks, option)
        cell = index.among(index.waits, option)
        rest = np.select([option == index.aside, look != NOTHING], [STAND_ASIDE, LOOK], DO_NOTHING)
        verb = np.append(self.plan.hazards.verb, "")[hazard]
        answer.hazard[worlds], answer.verb[worlds] = hazard, np.where(hazard == NOTHING, rest, verb)
        where = np.select([cell != NOTHING, look != NOTHING], [cell, look], table)
        answer.destination[worlds] = self._table[worlds] = where
        self._begun[worlds] = option

    def _within_reach_on_the_floor(self, percept: Percept) -> np.ndarray:
        """Return which candles to pick up from the floor, bool (B, candles)."""
        lying = np.zeros(percept.candle_table.shape, bool)
        if percept.candle_cell is not None:
            lying |= percept.candle_cell != NOTHING
        if percept.out_of_reach is not None:
            lying &= ~self.plan.hazards.split(percept.out_of_reach)[1]
        return lying


def each_on_a_table(plan: FloorPlan, percept: Percept) -> Percept:
    """Return the percept with each candle that is on the floor, or shares a table, moved to the nearest bare table.

    This occurs in the house only, and rarely. A candle in the hand stays there.
    """
    if percept.candle_cell is None:
        return percept
    tables = percept.candle_table.copy()
    places = np.array([plan.position(cell) for cell in plan.tables])
    for world, lying in enumerate(percept.candle_cell):
        first = np.unique(tables[world], return_index=True)[1]
        for candle in range(len(lying)):
            table = tables[world, candle]
            if candle == percept.holding[world] or (table != NOTHING and candle in first):
                continue
            here = plan.position(plan.free_cells[lying[candle]]) if table == NOTHING else places[table]
            distance = np.linalg.norm(places - here, axis=1)
            distance[tables[world][tables[world] != NOTHING]] = np.inf
            tables[world, candle] = distance.argmin()
    return dataclasses.replace(percept, candle_table=tables)


class KnowsGoalCaregiver(ForesightCaregiver, PrivilegedCaregiver):
    """The planner with privileged knowledge of each child's toy bin and epsilon, but not of its kind or random stream.

    It is no bound, as it makes the same approximations. An epsilon between two planned ones is believed to be either,
    with the right mean.
    """

    def hear(self, truth: Truth) -> None:
        goals = self.belief.probability.shape[2]
        bins = len(self.plan.bins)
        at_goal = truth.goal[..., None] == np.arange(goals)  # (B, K, G): as a novice
        known = np.array(EPSILONS)
        epsilon = np.clip(truth.epsilon, known[0], known[-1])
        above = np.clip(np.searchsorted(known, epsilon), 1, len(known) - 1)
        share = (epsilon - known[above - 1]) / (known[above] - known[above - 1])
        each = np.eye(len(known))
        of_epsilon = (1 - share)[..., None] * each[above - 1] + share[..., None] * each[above]
        novice = self.belief.probability[:, :, :bins].sum(axis=(2, 3), keepdims=True)
        known_child = novice * at_goal[..., None] * of_epsilon[:, :, None]
        self.belief.probability = np.where(np.arange(goals)[:, None] < bins, known_child, self.belief.probability)
