"""A house that its caregiver has made safe before the children come in, judged by poses and contacts in the physics."""

import numpy as np
import pytest
from scripted_child import SOUTH, STAY, Scripted

import caregiver_mj
from caregiver_mj.caregivers import make_caregiver
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.blocks import run_block
from caregiver_mj.experiments.settings import Settings, episode_random, episode_seed, episode_tapes
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans import layout
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.policy.perception import Perception
from caregiver_mj.viz.episode import Episode

# The candle stands where a child passes (table 0); table 1 is at the end of a blind passage.
PASSAGE = FloorPlan.parse("########\n#B....B#\n##CS#.##\n#####.##\n#####T##\n########", "passage")
PAPER = FloorPlan.load("paper")


def tables_bearing_candles(env):
    """On which table's top each candle stands: what its foot touches."""
    physics, model = env.physics, env.physics.model
    found = {}
    for contact in physics.data.contact:
        names = {model.id2name(contact.geom1, "geom").split("/")[0], model.id2name(contact.geom2, "geom").split("/")[0]}
        for candle in range(len(env.task.plan.candle_tables)):
            if f"candle_{candle}" in names:
                (other,) = names - {f"candle_{candle}"}
                found.setdefault(candle, set()).add(other)
    return found


def started(plan, caregiver="childproof", epsilon=0.5, random=0, **options):
    env = caregiver_mj.load("supervise", plan, epsilon, random, **options)
    policy = caregiver_mj.CaregiverPolicy(env, caregiver)
    return env, policy, env.reset()


def in_grid(plan, caregiver, seed=0):
    world = GridWorld(plan, 0.5, make_caregiver(caregiver, plan))
    world.reset([episode_tapes(seed, 1)])
    return world.candle_table[0].tolist()


@pytest.mark.parametrize("plan", [PAPER, PASSAGE], ids=["paper", "passage"])
def test_candles_stand_where_the_caregiver_has_put_them_as_in_the_grid(plan):
    wanted = in_grid(plan, "childproof")
    assert wanted != list(plan.candle_tables)
    env, policy, step = started(plan)
    seen = Perception(plan)
    seen.reset(step.observation)
    nothing_passed_over = np.zeros(len(plan.hazards), bool)
    percept = seen.percept(seen.look(step.observation, 0.0), NOTHING, nothing_passed_over)
    assert percept.candle_table[0].tolist() == wanted
    step = env.step(policy(step))
    assert tables_bearing_candles(env) == {candle: {f"table_{table}"} for candle, table in enumerate(wanted)}
    for _ in range(50):
        step = env.step(policy(step))
    places = np.array([[*plan.position(plan.tables[table]), layout.TABLE_HEIGHT] for table in wanted])
    np.testing.assert_allclose(env.physics.candle_poses()[:, :3], places, atol=0.021)
    assert env.physics.candle_upright().min() > 0.999
    assert env.task.outcome()["candles_dropped"] == 0


def test_a_bump_costs_what_stands_on_the_table_now():
    costs = {}
    for caregiver in ("guard", "childproof"):
        child = Scripted(PASSAGE, STAY)
        env, policy, _ = started(PASSAGE, caregiver, child)
        task, begin = env.task, env.task.initialize_episode

        def initialize_episode(physics, task=task, begin=begin):
            begin(physics)
            task.children[0].put((1, 2))  # north of table 0, the landing is beside that
            physics.set_toddler(task.children[0].walk)

        task.initialize_episode = initialize_episode
        child.move = SOUTH
        step = env.reset()
        for _ in range(84):
            step = env.step(policy(step))
        costs[caregiver] = task.outcome()["damage"]
    assert costs == {"guard": 4.0, "childproof": 1.0}


def test_all_else_is_drawn_alike():
    """Child, robot and every offset are those of the same episode with another caregiver."""
    (_, _, moved), (_, _, planned) = started(PASSAGE, "childproof"), started(PASSAGE, "guard")
    shift = PASSAGE.position(PASSAGE.tables[1]) - PASSAGE.position(PASSAGE.tables[0])
    np.testing.assert_allclose(
        moved.observation["candle_position"][0], planned.observation["candle_position"][0] + [*shift, 0.0], atol=1e-12
    )
    for key in set(planned.observation) - {"candle_position"}:
        np.testing.assert_array_equal(moved.observation[key], planned.observation[key], err_msg=key)


def test_evaluation_film_and_policy_run_the_same_episode():
    settings = Settings(PASSAGE, "house", ("childproof",), (1.0,), episodes=1, seed=5)
    (block,) = settings.blocks()
    (row,) = run_block(settings, block)["rows"]
    film = Episode.load("supervise", PASSAGE, 1.0, seed=5, caregiver="childproof")
    assert film.env.task.candles.starting_tables == in_grid(PASSAGE, "childproof") == [1]
    assert film.run_until(60.0)
    env = caregiver_mj.load("supervise", PASSAGE, 1.0, episode_random(episode_seed(5, 0)))
    policy = caregiver_mj.CaregiverPolicy(env, "childproof", seed=5)
    step = env.reset()
    met = 0
    while not step.last():
        if env.physics.time() == film.env.physics.time():  # whatever was shown until then, all is where it is
            np.testing.assert_array_equal(env.physics.data.qpos, film.env.physics.data.qpos)
            assert env.task.outcome() == film.env.task.outcome()
            met += 1
        step = env.step(policy(step))
    assert met == 1
    assert row["damage"] > 0
    outcome = env.task.outcome()
    assert {name: row[name] for name in outcome} == outcome


def test_a_policy_whose_house_is_not_prepared_says_so():
    env = caregiver_mj.load("supervise", PASSAGE, random=0)
    step = env.reset()
    with pytest.raises(CaregiverError, match=r"on tables \[1\] with ChildproofCaregiver, got \[0\]"):
        caregiver_mj.CaregiverPolicy(env, "childproof")(step)
    paper = caregiver_mj.CaregiverPolicy(env, "paper")
    caregiver_mj.CaregiverPolicy(env, "childproof")
    with pytest.raises(CaregiverError, match=r"on tables \[0\] with PaperCaregiver, got \[1\]"):
        paper(env.reset())


def test_each_episode_is_prepared_anew_with_its_own_seed():
    class Drawer(caregiver_mj.caregivers.Caregiver):
        """Draws where the candle shall stand."""

        def reset(self, batch, seeds=None, children=1):
            self.drawn = [int(np.random.default_rng(seed).integers(2)) for seed in seeds]

        def prepare(self, candle_table):
            return np.array(self.drawn)[:, None]

        def choose(self, percept):
            return np.full(len(percept.child_cell), NOTHING)

    env = caregiver_mj.load("supervise", PASSAGE, random=0)
    policy = caregiver_mj.CaregiverPolicy(env, Drawer(PASSAGE))
    starts = set()
    for seed in range(6):
        env.task.reseed(episode_random(seed))
        policy(env.reset())
        world = GridWorld(PASSAGE, 0.5, Drawer(PASSAGE))
        world.reset([episode_tapes(seed, 1)])
        assert env.task.candles.starting_tables == world.candle_table[0].tolist()
        starts.add(env.task.candles.starting_tables[0])
    assert starts == {0, 1}
