"""The least expected damage that any caregiver could leave: the whole decision process of the grid, solved exactly.

It shares nothing with `caregiver_mj.caregivers.foresight` but the house's moves and the novice. The caregiver is free
in every one of its three actions in a timestep: to walk to any cell next to it in which the child is not, to wait, to
get, to place.
"""

import itertools

import numpy as np

from caregiver_mj.children.novice import Novice
from caregiver_mj.plans.cell_graph import Target

ACTIONS = 3  # of the caregiver in a timestep


class Exact:
    """Discounted damage, and price of denied moves, to come in so many timesteps, told toy bin and epsilon.

    Attributes:
        value: Just before the child's move, (cells, bins, caregiver's cells, layouts): first the sets of tables that
            bear a candle, then those with one candle less, the last one being in the hand.
    """

    def __init__(self, plan, epsilon, timesteps, discount, price, random_price):
        self.plan, graph = plan, plan.graph
        cells, places, bins = len(plan.free_cells), len(plan.caregiver_cells), len(plan.bins)
        tables, candles = range(len(plan.tables)), len(plan.candle_tables)
        full = list(itertools.combinations(tables, candles))
        held = list(itertools.combinations(tables, candles - 1)) if candles else []
        self.layouts = {layout: number for number, layout in enumerate([*full, *held])}
        self._full = len(full)
        bears = np.array([[table in layout for table in tables] for layout in self.layouts], bool).reshape(
            len(self.layouts), len(tables)
        )
        greedy = Novice(plan, 0.0).action_probabilities()
        next_cell, target, index = graph.moves
        here, chance = np.arange(places), epsilon / 4 + (1 - epsilon) * greedy
        beside = graph.beside(plan.tables)
        value = np.zeros((cells, bins, places, len(self.layouts)))
        for _ in range(timesteps):
            after = value
            for _ in range(ACTIONS):
                after = self._act(after, beside)
            new = np.zeros_like(value)
            for cell, goal, move in itertools.product(range(cells), range(bins), range(4)):
                what, which, there = target[cell, move], index[cell, move], next_cell[cell, move]
                result = discount * after[cell, goal]
                if what == Target.STAIRWELL:
                    result = result + plan.damage.stairwell * (here != cells + which)[:, None]
                elif what == Target.TABLE:
                    result = result + np.where(bears[:, which], plan.damage.candle, plan.damage.table)
                elif what == Target.BIN and which == goal:
                    result = discount * after[cell].mean(axis=0)
                elif what == Target.FREE:
                    free = discount * after[there, goal]
                    result = np.where((here == there)[:, None], result, free)
                    denied = price * (1 - epsilon) * greedy[cell, goal, move] + random_price * epsilon / 4
                    new[cell, goal, there] += denied
                new[cell, goal] += chance[cell, goal, move] * result
            value = new
        self.value = value

    def _act(self, after, beside):
        """What is to come if one more action is done first, and the best one."""
        graph, best = self.plan.graph, after.copy()
        cells = np.arange(len(after))
        for place, neighbours in enumerate(graph.neighbours):
            for there in neighbours:
                reached = np.minimum(best[:, :, place], after[:, :, there])
                free = cells != there
                best[free, :, place] = reached[free]
        for layout, number in self.layouts.items():
            for table, stands in enumerate(beside):
                if number < self._full and table in layout:
                    other = self.layouts[tuple(one for one in layout if one != table)]
                elif number >= self._full and table not in layout:
                    other = self.layouts[tuple(sorted((*layout, table)))]
                else:
                    continue
                best[:, :, stands, number] = np.minimum(best[:, :, stands, number], after[:, :, stands, other])
        return best

    def at(self, child, goal, caregiver, candle_table):
        """What is to come in W worlds just before the child's move, all candles on tables, (W,)."""
        layout = [self.layouts[tuple(sorted(tables))] for tables in candle_table.tolist()]
        return self.value[child, goal, caregiver, layout]
