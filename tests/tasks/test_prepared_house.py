"""A house that its caregiver has made safe before the children come in, judged by poses and contacts in the physics."""

import numpy as np
import pytest
from scripted_child import SOUTH, STAY, Scripted

from caregiver_mj import CaregiverError, CaregiverPolicy, FloorPlan, load
from caregiver_mj.caregivers import make_caregiver
from caregiver_mj.experiments.spec import episode_streams
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans import layout
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.policy.perception import Perception

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


def started(plan, caregiver="childproof", epsilon=0.5):
    env = load("supervise", plan, epsilon, 0)
    policy = CaregiverPolicy(env, caregiver)
    return env, policy, env.reset()


@pytest.mark.parametrize("plan", [PAPER, PASSAGE], ids=["paper", "passage"])
def test_candles_stand_where_the_caregiver_has_put_them_as_in_the_grid(plan):
    world = GridWorld(plan, 0.5, make_caregiver("childproof", plan))
    world.reset([episode_streams(0, 1)])
    wanted = world.candle_table[0].tolist()
    assert wanted != list(plan.candle_tables)
    env, policy, step = started(plan)
    seen = Perception(plan)
    seen.reset(step.observation)
    no_cooldown = np.zeros(len(plan.hazards), bool)
    percept = seen.percept(seen.look(step.observation, 0.0), NOTHING, no_cooldown)
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


def test_a_policy_whose_house_is_not_prepared_says_so():
    env = load("supervise", PASSAGE, random=0)
    step = env.reset()
    with pytest.raises(CaregiverError, match=r"on tables \[1\] with ChildproofCaregiver, got \[0\]"):
        CaregiverPolicy(env, "childproof")(step)
    paper = CaregiverPolicy(env, "paper")
    CaregiverPolicy(env, "childproof")
    with pytest.raises(CaregiverError, match=r"on tables \[0\] with PaperCaregiver, got \[1\]"):
        paper(env.reset())
