"""The caregiver that knows what will come: what it is told, what it reckons with, and what it does about it."""

import os
import subprocess
import sys

import numpy as np
import pytest

from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.privileged import PrivilegedCaregiver
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from studies.bounds.clairvoyant import EFFORT, Hindsight, round_the_child, travel
from studies.results import BOUNDS

TWO_ENDS = """
#########
#S.....S#
###.#####
###B#####
#########
"""
TABLES = """
########
#C....T#
#......#
#.B..B.#
########
"""


def stays(cell, moves):
    return np.full((moves + 1, 1), cell)


def bumps(*objects):
    return np.array(objects)[:, None, None]


class TestFuture:
    def test_it_is_what_children_do_alone(self):
        class Listener(PaperCaregiver, PrivilegedCaregiver):
            told = None

            def hear(self, truth):
                self.told = self.told or truth.future()

        plan = FloorPlan.load("paper")
        listener = Listener(plan)
        children = len(["explorer:0.5"])
        chance = [RandomStream.draw_group(np.random.RandomState(seed), children) for seed in range(3)]
        told = GridWorld(plan, "explorer:0.5", listener)
        told.reset(chance)
        told.step()
        alone = GridWorld(plan, "explorer:0.5", None)
        alone.reset(chance)
        alone.step()
        same = (alone.child_cell == told.child_cell).all(axis=1)  # where the caregiver was not in the way at once
        assert same.any()
        cells, damage = [], []
        for _ in range(len(listener.told.cell)):
            before = alone.ledger.damage
            alone.step()
            cells.append(alone.child_cell)
            damage.append(alone.ledger.damage - before)
        assert (listener.told.cell[:, same] == np.array(cells)[:, same]).all()
        hits = (listener.told.object >= 0).any(axis=2)
        assert (hits[:, same] == (np.array(damage)[:, same] > 0)).all()


class TestHindsight:
    def test_two_stairwells_by_hand(self):
        # Six actions lie between the landings. With the three that are left after a move of the child it takes until
        # after its next one.
        plan = FloorPlan.parse(TWO_ENDS)
        programme, cells = Hindsight(plan), stays(5, 4)  # the child is in the bin's bay

        def least(*objects):
            return programme.to_come(cells, bumps(*objects), programme.carrying(cells), 1)[0, :, 0].tolist()

        assert least(NOTHING, NOTHING, 0, NOTHING) == [0, 0]
        assert least(NOTHING, 0, 0, NOTHING) == [0, 5]  # from the second it comes too late for the one of the two
        assert (least(0, 1, NOTHING, NOTHING), least(0, NOTHING, 1, NOTHING)) == ([5, 5], [0, 5])
        assert least(1, 0, 1, 0) == [10, 10]

    def test_a_candle_by_hand(self):
        plan = FloorPlan.parse(TABLES)
        programme, cells = Hindsight(plan), stays(13, 8)  # the child is in the bay at the right
        on_first, on_second = (
            programme.post_stand[programme.layouts.now(np.array([[table]]))[0], 0] for table in (0, 1)
        )

        def to_come(*objects):
            """Damage by a candle that stays is left out."""
            return programme.to_come(cells, bumps(*objects), programme.carrying(cells), 1)[0, :, 0]

        never = [NOTHING] * 7
        assert to_come(*never, NOTHING)[on_first] == 0
        assert to_come(*never, 0)[on_first] == pytest.approx(EFFORT - 3)  # 4 - 1 is saved
        assert to_come(0, *never)[on_first] == 0  # too late
        assert to_come(*never[1:], 1, 1)[on_first] == 0
        assert to_come(*never[1:], 1, 1)[on_second] == pytest.approx(EFFORT - 6)

    def test_ways_round_a_child_whose_moves_are_known(self):
        plan = FloorPlan.parse(TWO_ENDS)
        near_second = np.array([[plan.cell_index[(1, 6)]]])
        moves, denied = round_the_child(travel(plan), stays(5, 6), near_second, 3)
        assert moves[:, 0, 0].tolist() == [1, 0]  # five actions and one
        assert not denied.any()
        walks = np.array([plan.cell_index[1, column] for column in (2, 3, 4, 5)])[:, None]
        moves, denied = round_the_child(travel(plan), walks, near_second, 3)
        assert not denied.any()  # on the way to the first it goes back before the child


def test_commands_find_it_by_name_in_a_checkout(tmp_path):
    command = [sys.executable, "-m", "caregiver_mj", "list", "caregivers"]
    environment = os.environ | {"PYTHONPATH": str(BOUNDS)}
    ran = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert any(line.startswith("clairvoyant ") and "caregiver_mj_bounds" in line for line in ran.stdout.splitlines())
