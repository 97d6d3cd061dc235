"""The tasks: dm_env's contract, what can be observed and commanded, determinism, and agreement with the grid."""

import gc
import itertools
import weakref

import numpy as np
import pytest
from absl.testing import absltest
from dm_control.rl import control
from dm_env import test_utils
from scripted_child import EAST, SOUTH, STAY, Scripted

import caregiver_mj
from caregiver_mj import FloorPlan
from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.grid.world import GridWorld, run_episodes
from caregiver_mj.interventions.verb import DO_NOTHING, Interventions
from caregiver_mj.plans.hazards import NOTHING, DamageWeights
from caregiver_mj.recording.record import COLUMNS
from caregiver_mj.tasks.base import OBSERVED

PLAN = FloorPlan.parse("########\n#B....C#\n#....T.#\n#.S....#\n#....TB#\n########", "small")
NO_CANDLE = FloorPlan.parse("#####\n#B.S#\n#..T#\n#####", "no_candle")
TIME_LIMIT = 1.0  # seconds
every_task = pytest.mark.parametrize("task", caregiver_mj.ALL_TASKS)


def load(task: str, plan: FloorPlan = PLAN, seed: int = 0, epsilon: float = 0.5, **task_kwargs) -> control.Environment:
    return caregiver_mj.load(task, plan, epsilon, seed, task_kwargs=task_kwargs)


class ContractTest(test_utils.EnvironmentTestMixin):
    """The conformance tests of dm_env, with action sequences that pass the end of an episode."""

    task: str
    robot = True

    def make_object_under_test(self):
        return load(self.task, time_limit=TIME_LIMIT, robot=self.robot)

    def make_action_sequence(self):
        spec, random = self.environment.action_spec(), np.random.default_rng(0)
        return (random.uniform(spec.minimum, spec.maximum) for _ in range(60))

    def step_environment(self, action=None):
        step = super().step_environment(action)
        self.ends = getattr(self, "ends", 0) + step.last()
        return step

    def test_longer_action_sequence(self):
        super().test_longer_action_sequence()
        assert self.ends == 2  # one in each of its two runs


for _name, _robot in [*((name, True) for name in caregiver_mj.ALL_TASKS), ("supervise", False)]:
    _class = f"Test_{_name}_{'with' if _robot else 'without'}_robot"
    globals()[_class] = type(_class, (ContractTest, absltest.TestCase), {"task": _name, "robot": _robot})
del ContractTest  # not a test by itself


def test_faster_children_make_timesteps_shorter_and_cross_a_cell_in_one():
    env = load("supervise", NO_CANDLE, robot=False, child_speed=0.8)
    env.reset()
    task = env.task
    for _ in range(20):  # some moves are bumps, which are faster
        begun, place = task.timestep, np.array(task.children[0].position)
        while task.timestep == begun:
            env.step(np.zeros(0))
        way = np.array(task.children[0].position) - place
        assert np.abs(way).max() == pytest.approx(0.75, abs=1e-3) or np.abs(way).max() < 1e-3
    assert env.physics.time() == pytest.approx(20 * 0.94)  # 0.9375 s in steps of 20 ms


def test_a_move_that_the_episode_cuts_short_counts():
    """Some of ten children bump into something within 1.5 s, most of a move."""
    env = load("block_stairs", epsilon=1.0, time_limit=1.5)
    idle, damages = np.zeros(env.action_spec().shape), []
    for _ in range(10):
        env.reset()
        while not env.step(idle).last():
            before_the_last_step = env.task.damage
        damages.append(env.task.outcome()["damage"])
        assert damages[-1] >= before_the_last_step
    assert max(damages) > 0


@every_task
def test_observations_and_rewards_over_scripted_episodes(task):
    env = load(task, epsilon=0.7, time_limit=25.0)
    policy, spec, episodes = caregiver_mj.CaregiverPolicy(env), env.observation_spec(), []
    for _ in range(3):
        episodes.append([env.reset()])
        while not episodes[-1][-1].last():
            episodes[-1].append(env.step(policy(episodes[-1][-1])))
    for step in itertools.chain.from_iterable(episodes):
        assert set(step.observation) == set(spec)
        for key, value in step.observation.items():
            assert value.shape == spec[key].shape
            assert value.dtype == spec[key].dtype
            assert np.isfinite(value).all()
    rewards = np.array([step.reward for steps in episodes for step in steps[1:]])
    assert rewards.min() >= 0.0
    assert rewards.max() <= 1.0
    assert np.ptp(rewards) > 0.1
    for key in spec:
        # (episodes, time steps, ...)
        values = np.array([[step.observation[key] for step in steps] for steps in episodes])
        within = np.ptp(values, axis=1).max(axis=0)
        if key.startswith("goal_"):
            assert within.max() == 0.0, key
            assert np.ptp(values[:, 0], axis=0).max(initial=0) > 0 or values.shape[-1] == 1, key
        else:
            assert within.max() > 1e-6, key
            assert (np.ptp(values, axis=(0, 1)) > 0).all(), key  # no component is dead


@pytest.mark.parametrize("children", ["0.5", "1,.25"])
@every_task
def test_every_observed_key_is_as_it_is_said_to_be(task, children):
    needs, plan = caregiver_mj.tasks.TASKS[task].find_kind().needs, FloorPlan.load("paper")
    if needs and needs not in plan.hazards.kinds:
        plan = FloorPlan.load("home")
    env = caregiver_mj.load(task, plan, children, visuals=False)
    counts = {"candles": len(plan.candle_tables), "tables": len(plan.tables), "stairwells": len(plan.stairwells)}
    counts |= {"gates": len(plan.mouths), "batteries": len(plan.floor_cells), "joints": 7, "children": 2}
    seen = {key: spec.shape for key, spec in env.observation_spec().items()}
    assert set(seen) == {key for key, observed in env.task.observed.items() if not observed.asked or key in seen}
    for key, shape in seen.items():
        one, _, several = env.task.observed[key].shape.partition(", of several children ")
        assert shape == eval(several if several and children == "1,.25" else one, counts)


def test_what_is_asked_for_is_shown():
    env = caregiver_mj.load("supervise", "paper", visuals=False, task_kwargs={"table_height": (0.5, 0.7)})
    asked = {key for key, observed in OBSERVED.items() if observed.asked}
    assert asked == {"table_height", "gate_position", "battery_position", "toddler_seen", "cell_seen"}
    assert env.observation_spec()["table_height"].shape == (len(env.task.plan.tables),)


def test_goal_observations_point_from_here_to_there():
    env = load("block_stairs")
    seen = env.reset().observation
    landing = PLAN.position(PLAN.stairwells[0])
    np.testing.assert_allclose(seen["base_position"][:2] + seen["base_to_goal"], landing, atol=1e-9)
    env = load("relocate_candle")
    seen = env.reset().observation
    table = PLAN.position(PLAN.tables[int(seen["goal_table"].argmax())])
    np.testing.assert_allclose(seen["candle_position"][0] + seen["candle_to_goal"], [*table, 0.6], atol=1e-9)


@pytest.mark.parametrize(
    ("plan", "epsilon", "seed"),
    [
        (FloorPlan.load("paper", damage=DamageWeights(2.0, 7.0, 0.5)), "1,.5,adversary:0", 8),
        (FloorPlan.load("house-11-11x9-stairwells2-candles3", cell_size=0.9), 0.75, 5),
    ],
    ids=["three_children", "large_cells"],
)
def test_unassisted_toddler_fares_in_the_house_as_in_the_grid(plan, epsilon, seed):
    env = caregiver_mj.load("supervise", plan, epsilon=epsilon, task_kwargs={"robot": False})
    env.task.reseed(seed)
    step = env.reset()
    while not step.last():
        step = env.step(np.zeros(0))
    expected = run_episodes(plan, epsilon, None, [seed])
    in_both = {column.name for column in COLUMNS if not column.world}
    ours, theirs = ({k: v for k, v in found.outcome().items() if k in in_both} for found in (env.task, expected))
    assert ours == theirs
    assert ours["damage"] > 0
    np.testing.assert_array_equal(env.task.ledger.visits, expected.visits)
    np.testing.assert_array_equal(env.task.ledger.damage_at, expected.damage_at)


class Still(Caregiver):
    """Stays where it is, and lets nobody by."""

    yields = False

    def choose(self, percept):
        return np.full(len(percept.caregiver_cell), NOTHING)

    def decide(self, percept):
        nothing = Interventions.idle(len(percept.caregiver_cell))
        nothing.verb[:] = DO_NOTHING
        return nothing


@pytest.mark.parametrize(
    ("rows", "seed", "denied"),
    [("######\n#S..B#\n#....#\n#B.TC#\n######", 3, "free"), ("#####\n#S.B#\n##T##\n#####", 3, "stairwell")],
    ids=["in_a_cell", "on_a_landing"],
)
def test_a_caregiver_in_the_way_denies_the_same_in_the_house_and_in_the_grid(rows, seed, denied):
    """Both worlds, run for 20 novice timesteps, count all alike; that takes 3 s in the house."""
    plan = FloorPlan.parse(rows, "small")
    world = GridWorld(plan, 0.75, Still(plan))
    world.reset([RandomStream.draw_group(np.random.RandomState(seed), 1)])
    env = caregiver_mj.load("supervise", plan, epsilon=0.75, visuals=False)
    env.task.reseed(seed)
    policy, step = caregiver_mj.CaregiverPolicy(env, Still(plan)), env.reset()
    for timestep in range(1, 21):
        world.step()
        while env.task.timestep < timestep:
            step = env.step(policy(step))
    ours, theirs = world.ledger.outcome(), env.task.ledger.outcome()
    assert ours == theirs
    assert ours[f"moves_blocked_{denied}"] > 0
    np.testing.assert_array_equal(env.task.ledger.damage_at, world.ledger.damage_at)


@pytest.mark.parametrize(("task", "caregiver"), [("supervise", "foresight"), ("relocate_candle", "expected-danger")])
def test_what_nobody_holds_any_more_is_gone_at_once(task, caregiver):
    """Left to the garbage collector, simulations would be cleared away in the midst of later episodes, in 50 ms."""
    gc.collect()
    gc.disable()
    try:
        env = load(task)
        policy, step = caregiver_mj.CaregiverPolicy(env, caregiver), env.reset()
        for _ in range(200):
            step = env.step(policy(step))
        held = [weakref.ref(one) for one in (env.physics, env.task, policy)]
        del env, policy, step
        assert [one() for one in held] == [None] * len(held)
    finally:
        gc.enable()


@pytest.mark.parametrize(("rows", "children"), [("#S.B#", 2), ("#..B#", 1)])
def test_where_there_is_room_for_the_robot_it_is_apart(rows, children):
    """On a landing there is, even where children share a cell."""
    wall = "#" * len(rows)
    env = caregiver_mj.load("supervise", FloorPlan.parse(f"{wall}\n{rows}\n{wall}", "tiny"), [0.5] * children, 0)
    env.reset()
    apart = env.physics.base_position()[:2] - env.physics.toddler_positions()[:, :2]
    assert (np.linalg.norm(apart, axis=1) > 0.5).all()


MOVE = 84  # control steps of a novice timestep


def timesteps(env, count=1):
    action = np.zeros(0)
    if env.task.has_robot:
        action = np.array([0, 0, 0, *env.physics.arm_position(), 0.03])
    return [env.step(action).reward for _ in range(count * MOVE)]


#                         the stairwell's landing is south of (1, 3), a table south of (1, 5), a candle's of (1, 1)
ROW = FloorPlan.parse("########\n#.....B#\n#C#S#T##\n########", "row")


def row(*moves, damage=DamageWeights(), robot=False):
    """Children in the cells of a row above things to bump into, with the moves that they make."""
    plan = FloorPlan.parse("\n".join(ROW.rows), damage=damage)
    env = caregiver_mj.load("supervise", plan, [Scripted(plan, move) for _, move in moves], 0, {"robot": robot})
    env.reset()
    for child, (column, _) in zip(env.task.children, moves, strict=True):
        child.put((1, column))
    return env


@pytest.mark.parametrize(
    ("damage", "rewards"),
    [
        (DamageWeights(), {1.0, 1 - 4 / 5}),  # the worst of both: the candle's 4
        (DamageWeights(8.0, 2.0, 4.0), {1.0, 1 - 2 / 8, 1 - 4 / 8}),  # the candle first, or the table
        (DamageWeights(0.0, 0.0, 0.0), {1.0}),
    ],
)
def test_reward_is_less_by_the_worst_harm_of_any_child_now(damage, rewards):
    env = row((1, SOUTH), (5, SOUTH), damage=damage)
    seen = timesteps(env)
    assert set(seen) <= rewards | {1 - 1 / 5}
    assert min(seen) == min(rewards)
    assert seen[-1] == 1.0  # booked
    assert seen[0] == 1.0


def test_who_waits_for_another_is_not_hurt_and_not_blocked():
    env = row((2, EAST), (3, STAY), robot=True)
    env.physics.set_robot(np.array([*ROW.position((1, 5)), 0.0]))
    timesteps(env, 3)
    outcome = env.task.outcome()
    assert outcome["damage"] == outcome["moves_blocked"] == outcome["strikes"] == 0
    assert [child.cell for child in env.task.children] == [ROW.cell_index[1, 2], ROW.cell_index[1, 3]]
    assert outcome["cells_visited"] >= 2
