"""What nobody would give to the public constructors on purpose: a line that says what is wrong, and no other error."""

import gymnasium
import numpy as np
import pytest

import caregiver_mj
from caregiver_mj.caregivers import Caregiver, make_caregiver
from caregiver_mj.caregivers.foresight.value_table import AllLayouts
from caregiver_mj.children.child_group import ChildSpec
from caregiver_mj.children.novice import Novice
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.envs.houses_vector import GridHousesVector
from caregiver_mj.envs.target_grid import GridTargetsVector
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.finished import pool_runs
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.grid.world import GridWorld, run_episodes
from caregiver_mj.interventions.verb import Intervention, Interventions
from caregiver_mj.plans.generator import generate
from caregiver_mj.plans.hazards import NOTHING, DamageWeights
from caregiver_mj.plans.sets import house_set
from caregiver_mj.policy.own import OwnPolicy
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.viz.report import write_report

TEXT = "######\n#B.S.#\n#....#\n#C..T#\n######"
TINY = caregiver_mj.FloorPlan.parse(TEXT, "tiny")


def load(task="supervise", house=TINY, **options):
    return caregiver_mj.load(task, house, **{"random": 0, "visuals": False} | options)


def policy(*arguments):
    return caregiver_mj.CaregiverPolicy(load(), *arguments)


def settings(**options):
    return Settings(**{"plans": (TINY,), "world": "grid", "episodes": 1} | options).check()


def make(name="Supervise-Targets"):
    return gymnasium.make(f"caregiver_mj/{name}-v0", house=TINY)


def act(env, action):
    env.reset(seed=0)
    env.step(action)


def run(streams, children="1"):
    GridWorld(TINY, children, None).run(streams)


def move_after_the_end():
    world = GridWorld(TINY, "1", None)
    world.run(ONE)
    world.move_children()


def act_in_mid_episode():
    env = load()
    env.reset()
    caregiver_mj.CaregiverPolicy(env)(env.step(np.zeros(11)))


class Deciding(Caregiver):
    def __init__(self, *answered):
        super().__init__(TINY)
        self._answered = Intervention(*answered)

    def choose(self, percept):
        return np.full(len(percept.child_cell), NOTHING)

    def decide(self, percept):
        return Interventions.of([self._answered] * len(percept.child_cell))


def decide(*answered):
    run_episodes(TINY, 0.5, Deciding(*answered), [0])


def failing(*_):
    raise RuntimeError("mine")


class Failing(Caregiver):
    """Cannot be made."""

    __init__ = failing
    choose = None


class FailingChild(Novice):
    """Likewise."""

    __init__ = failing


def act_with(made):
    env = load()
    OwnPolicy("mine", lambda env: made, env)(env.reset())


def step_vector(actions, seed=0):
    envs = GridTargetsVector(3, house=TINY)
    envs.reset(seed=seed)
    envs.step(actions)


ONE = [RandomStream.draw_group(np.random.RandomState(0), 1, timesteps=2)]

PAPER = caregiver_mj.FloorPlan.load("paper")
OTHER_DAMAGE = caregiver_mj.FloorPlan.parse(TEXT, "tiny", damage="1:9:1")
ODD = {
    "load": [
        (lambda: load(house=3), "must be a str or PathLike"),
        (lambda: load(house="a\0b"), "cannot be read"),
        (lambda: load(epsilon=None), "children must be an epsilon"),
        (lambda: load(epsilon=10**400), "children must be an epsilon"),
        (lambda: load(epsilon=ChildSpec(0.5, 5)), "name of a child must be a str, got 5"),
        (lambda: load(epsilon=[]), "children must be at least 1"),
        (lambda: load(epsilon=np.array([0.5, 7.0])), "epsilon must be in"),
        (lambda: load(random=1.5), "must be an integer from 0 to 4294967295"),
        (lambda: load(random=2**40), "must be an integer from 0 to 4294967295"),
        (lambda: load(task_kwargs=[1]), "task_kwargs must be a dict or None"),
        (lambda: load(task_kwargs={"embodiment": 3}), r"robot must be a name \(mobile_fr3, mobile_ur5e\) or an"),
    ],
    "floor plan": [
        (lambda: caregiver_mj.FloorPlan.parse(None), "text of a floor plan must be a str"),
        (lambda: caregiver_mj.FloorPlan.parse(TEXT, cell_size=None), "cell size"),
        (lambda: caregiver_mj.FloorPlan.parse(TEXT, cell_size=np.nan), "cell size"),
        (lambda: caregiver_mj.FloorPlan.load("test-100/house-" + "1" * 5000), "house-1111"),
        (lambda: caregiver_mj.FloorPlan.parse(TEXT, None), "name of a floor plan must be a str"),
        (lambda: caregiver_mj.FloorPlan.parse(TEXT, damage=3), "damage, if no DamageWeights or mapping, must be a str"),
        (lambda: DamageWeights("a"), "damage of a stairwell must be a number"),
        (lambda: DamageWeights(np.inf), "damage of a stairwell must be a number"),
        (lambda: DamageWeights(1e308), r"damage of a stairwell must be at most 1e\+06"),
        (lambda: generate(1.5), "the seed must be an integer"),
        (lambda: generate(0, (10,)), "size must be columns and rows"),
        (lambda: generate(0, (10.5, 10)), "rows and columns must be 5 to 100, got 10.5"),
        (lambda: house_set(3), "no set of floor plans"),
    ],
    "caregiver": [
        (lambda: policy(3), "a caregiver must be a str or Caregiver"),
        (lambda: policy("random", -1), "seed of a caregiver must be an integer of at least 0"),
        (lambda: caregiver_mj.CaregiverPolicy(None), "got NoneType"),
        (lambda: caregiver_mj.CaregiverPolicy(make("BlockStairs")), "env.unwrapped.dm_env"),
        (lambda: make_caregiver(f"{__name__}:Failing", TINY), "failed as it was made: RuntimeError: mine .*test_odd"),
        (lambda: load(epsilon=f"{__name__}:FailingChild:0.5"), "failed as it was made: RuntimeError: mine .*test_odd"),
        (lambda: find_embodiment(f"{__name__}:failing"), "failed as it was made: RuntimeError: mine .*test_odd"),
        (lambda: AllLayouts(64, 1), "tables must be at most 63 to plan for candles, got 64"),
        (lambda: make_caregiver(None, TINY), "name of a caregiver must be a str"),
        (lambda: make_caregiver("paper", "paper"), "house of a caregiver must be a FloorPlan"),
        (
            lambda: policy()(load().reset().observation),
            "must be given the time step of env.step or .*, got OrderedDict",
        ),
        (act_in_mid_episode, "first time step that a caregiver's policy sees must be that of env.reset"),
        (lambda: decide("relocate", 0, 1), r"decide: 'relocate' must be for a candle or mug, \[1\], got hazard 0"),
        (lambda: decide("block", NOTHING, NOTHING), "'block' must be for a stairwell, .* got hazard -1"),
        (lambda: act_with(lambda timestep: None), "'mine' must answer with 11 finite numbers, got"),
        (lambda: act_with(lambda timestep: np.full(11, np.nan)), "'mine' must answer with 11 finite numbers, got"),
    ],
    "grid": [
        (lambda: GridWorld("paper", 0.5, None), "house must be a FloorPlan, .* FloorPlan.load makes one"),
        (lambda: GridWorld(TINY, 0.5, "paper"), "must be a Caregiver or None, .* make_caregiver makes one"),
        (lambda: run([]), "at least 1 episode"),
        (lambda: GridWorld(TINY, 0.5, None).move_children(), "no episode has begun, or it is over: call reset"),
        (move_after_the_end, "no episode has begun, or it is over: call reset"),
        (lambda: GridWorld(TINY, 0.5, None, caregiver_actions=0.5), "caregiver_actions must be in 1 to 100"),
        (lambda: run(ONE, "1,1"), "streams must be 2 in each"),
        (lambda: GridWorld(TINY, 0.5, make_caregiver("paper", PAPER)), "for house 'tiny', got one for 'paper'"),
        (lambda: GridWorld(OTHER_DAMAGE, 0.5, make_caregiver("paper", TINY)), "'tiny' of other cells or damage"),
    ],
    "run": [
        (lambda: settings(plans="paper"), "a house must be a FloorPlan"),
        (lambda: settings(episodes=1.5), "episodes must be an integer of at least 1"),
        (lambda: settings(seed=-1), "seed must be an integer of at least 0"),
        (lambda: evaluate(Settings(TINY, "grid", episodes=1), jobs="a"), "jobs must be an integer of at least 1"),
        (lambda: write_report([]), "at least 1 run"),
        (lambda: pool_runs([], "nowhere"), "at least 2, got 0"),
        (lambda: Settings(()).plan, "houses must be 1, got 0"),
        (lambda: evaluate(Settings(TINY, "grid", episodes=1), "DIR"), "folder must be a RunFolder or None, got"),
    ],
    "environment": [
        (lambda: act(make(), 99), "an action must be an integer from 0 to 2"),
        (lambda: act(make("BlockStairs"), "a"), "an action must be an array of numbers"),
        (lambda: GridTargetsVector(100_001), "num_envs must be an integer from 1 to 100000"),
        (lambda: GridHousesVector([TINY], 0), "num_envs must be an integer from 1 to 100000, got"),
        (lambda: GridTargetsVector(1, house=TINY, slots=(2, 1001)), "slots must be at most 1,000 of a kind, got"),
        (lambda: GridHousesVector([]), "houses must be at least 1"),
        (lambda: GridHousesVector([TINY], 2, render_mode="rgb_array"), "render_mode must be None"),
        (lambda: act(make(), [1, 2]), "an action must be one integer, got"),
        (lambda: step_vector(np.zeros((3, 1), int)), "actions must be 3 integers, one for each episode"),
        (lambda: step_vector(np.zeros(3, int), 3.5), "the seed must be an integer, or one for each of 3"),
        (lambda: step_vector(np.zeros(3, int), [1, 2]), "seeds must be 3, one for each episode, got 2"),
        (lambda: GridHousesVector(TINY, 2), "houses must be several"),
        (lambda: GridHousesVector([TINY], 2, families=0.5), "families must be several, such as"),
        (lambda: GridHousesVector([TINY], 2, families=("1", "1,.5")), "child groups must be of the same size"),
        (lambda: GridHousesVector([TINY], 3, 2), "at_once, .* must be an integer from 1 to 1, got 2"),
        (lambda: GridHousesVector([TINY, "paper"], 3), "must be a multiple of 2 houses at once x 1 families, got 3"),
    ],
}


@pytest.mark.parametrize(
    ("call", "words"),
    [pytest.param(*case, id=f"{of}-{i}") for of, cases in ODD.items() for i, case in enumerate(cases)],
)
def test_refused_in_a_line(call, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(CaregiverError, match=words) as error:
        call()
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("make", [lambda: GridTargetsVector(2, house=TINY), lambda: GridHousesVector([TINY], 2)])
def test_a_vector_must_be_reset_first(make):
    with pytest.raises(gymnasium.error.ResetNeeded):
        make().step(np.zeros(2, int))
