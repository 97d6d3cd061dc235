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


def act(action):
    env = gymnasium.make("caregiver_mj/Supervise-Targets-v0", house=TINY)
    env.reset(seed=0)
    env.step(action)


def act_in_the_house(action):
    env = gymnasium.make("caregiver_mj/BlockStairs-v0", house=TINY)
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
    """Answers with what it was made for."""

    def __init__(self, *answered):
        super().__init__(TINY)
        self._answered = Intervention(*answered)

    def choose(self, percept):
        return np.full(len(percept.child_cell), NOTHING)

    def decide(self, percept):
        return Interventions.of([self._answered] * len(percept.child_cell))


class Failing(Caregiver):
    """Cannot be made."""

    def __init__(self, plan, seed=0):
        raise RuntimeError("mine")

    choose = None


class FailingChild(Novice):
    """Likewise."""

    def __init__(self, plan, epsilon):
        raise RuntimeError("mine")


def failing():
    raise RuntimeError("mine")


def act_with(made):
    env = load()
    OwnPolicy("mine", lambda env: made, env)(env.reset())


def step_vector(actions, seed=0):
    envs = GridTargetsVector(3, house=TINY)
    envs.reset(seed=seed)
    envs.step(actions)


ONE = [RandomStream.draw_group(np.random.RandomState(0), 1, timesteps=2)]

ODD = {
    "load": [
        *((lambda house=house: load(house=house), "must be a str or PathLike") for house in (None, 3)),
        (lambda: load(house="a\0b"), "cannot be read"),
        *((lambda e=e: load(epsilon=e), "children must be an epsilon") for e in (None, {}, 1j)),
        *((lambda e=e: load(epsilon=e), "children must be an epsilon") for e in (10**400, np.array("x"))),
        (lambda: load(epsilon=ChildSpec(0.5, 5)), "name of a child must be a str, got 5"),
        (lambda: load(epsilon=[]), "children must be at least 1"),
        (lambda: load(epsilon=np.array([0.5, 7.0])), "epsilon must be in"),
        *((lambda r=r: load(random=r), "must be an integer from 0 to 4294967295") for r in ("a", 1.5, -1, 2**40)),
        (lambda: load(task_kwargs=[1]), "task_kwargs must be a dict or None"),
        *(
            (
                lambda e=e: load(task_kwargs={"embodiment": e}),
                r"robot must be a name \(mobile_fr3, mobile_ur5e\) or an Embodiment, got",
            )
            for e in (3, ["mobile_fr3"])
        ),
    ],
    "floor plan": [
        (lambda: caregiver_mj.FloorPlan.parse(None), "text of a floor plan must be a str"),
        *(
            (lambda c=c: caregiver_mj.FloorPlan.parse(TEXT, cell_size=c), "cell size")
            for c in (None, 0, np.nan, 10**400, 10**4)
        ),
        *(
            (lambda n=n: caregiver_mj.FloorPlan.load(n + "1" * 5000), "house-1111")
            for n in ("house-", "test-100/house-")
        ),
        (lambda: caregiver_mj.FloorPlan.parse(TEXT, None), "name of a floor plan must be a str"),
        (lambda: caregiver_mj.FloorPlan.parse(TEXT, damage=3), "damage, if no DamageWeights or mapping, must be a str"),
        *((lambda d=d: DamageWeights(d), "damage of a stairwell must be a number") for d in ("a", -1, np.inf)),
        (lambda: DamageWeights(1e308), r"damage of a stairwell must be at most 1e\+06"),
        *((lambda s=s: generate(s), "the seed must be an integer") for s in ("a", 1.5)),
        *((lambda s=s: generate(0, s), "size must be columns and rows") for s in (5, (10,))),
        (lambda: generate(0, (10.5, 10)), "rows and columns must be 5 to 100, got 10.5"),
        (lambda: house_set(3), "no set of floor plans"),
    ],
    "caregiver": [
        (lambda: policy(3), "a caregiver must be a str or Caregiver"),
        (lambda: policy("random", -1), "seed of a caregiver must be an integer of at least 0"),
        (lambda: caregiver_mj.CaregiverPolicy(None), "got NoneType"),
        (
            lambda: caregiver_mj.CaregiverPolicy(gymnasium.make("caregiver_mj/BlockStairs-v0", house=TINY)),
            "env.unwrapped.dm_env",
        ),
        (lambda: make_caregiver(f"{__name__}:Failing", TINY), "failed as it was made: RuntimeError: mine .*test_odd"),
        (lambda: load(epsilon=f"{__name__}:FailingChild:0.5"), "failed as it was made: RuntimeError: mine .*test_odd"),
        (lambda: find_embodiment(f"{__name__}:failing"), "failed as it was made: RuntimeError: mine .*test_odd"),
        (lambda: AllLayouts(64, 1), "tables must be at most 63 to plan for candles, got 64"),
        (lambda: make_caregiver(None, TINY), "name of a caregiver must be a str"),
        (lambda: make_caregiver("paper", "paper"), "house of a caregiver must be a FloorPlan"),
        (lambda: make_caregiver("random", TINY, "x"), "seed of a caregiver must be an integer"),
        (
            lambda: policy()(load().reset().observation),
            "must be given the time step of env.step or .*, got OrderedDict",
        ),
        (act_in_mid_episode, "first time step that a caregiver's policy sees must be that of env.reset"),
        *(
            (lambda a=a: run_episodes(TINY, 0.5, Deciding(*a), [0]), words)
            for a, words in (
                (("relocate", 0, 1), r"decide: 'relocate' must be for a candle or mug, \[1\], got hazard 0"),
                (("block", NOTHING, NOTHING), "'block' must be for a stairwell, .* got hazard -1"),
            )
        ),
        *(
            (lambda a=a: act_with(lambda timestep: a), "'mine' must answer with 11 finite numbers, got")
            for a in (None, np.zeros(5), np.full(11, np.nan))
        ),
    ],
    "grid": [
        (lambda: GridWorld("paper", 0.5, None), "house must be a FloorPlan, .* FloorPlan.load makes one"),
        (lambda: GridWorld(TINY, 0.5, "paper"), "must be a Caregiver or None, .* make_caregiver makes one"),
        (lambda: run([]), "at least 1 episode"),
        (lambda: GridWorld(TINY, 0.5, None).move_children(), "no episode has begun, or it is over: call reset"),
        (move_after_the_end, "no episode has begun, or it is over: call reset"),
        *(
            (
                lambda n=n: GridWorld(TINY, 0.5, None, caregiver_actions=n),
                "caregiver_actions must be in 1 to 100",
            )
            for n in (0, -1, 0.5, "3")
        ),
        (lambda: run(ONE, "1,1"), "streams must be 2 in each"),
        (lambda: run_episodes(TINY, 0.5, None, [-1]), "seed of an episode must be an integer from 0"),
        (
            lambda: GridWorld(TINY, 0.5, make_caregiver("paper", caregiver_mj.FloorPlan.load("paper"))),
            "PaperCaregiver must be made for house 'tiny', got one for 'paper'",
        ),
        (
            lambda: GridWorld(
                caregiver_mj.FloorPlan.parse(TEXT, "tiny", damage="1:9:1"), 0.5, make_caregiver("paper", TINY)
            ),
            "must be made for house 'tiny', got one for 'tiny' of other cells or damage",
        ),
    ],
    "run": [
        (lambda: settings(plans="paper"), "a house must be a FloorPlan"),
        *((lambda n=n: settings(episodes=n), "episodes must be an integer of at least 1") for n in ("a", 1.5, 0)),
        *((lambda s=s: settings(seed=s), "seed must be an integer of at least 0") for s in ("a", 0.5, -1)),
        (lambda: evaluate(Settings(TINY, "grid", episodes=1), jobs="a"), "jobs must be an integer of at least 1"),
        (lambda: write_report([]), "at least 1 run"),
        (lambda: pool_runs([], "nowhere"), "at least 2, got 0"),
        (lambda: Settings(()).plan, "houses must be 1, got 0"),
        (lambda: evaluate(Settings(TINY, "grid", episodes=1), "DIR"), "folder must be a RunFolder or None, got"),
    ],
    "environment": [
        *((lambda a=a: act(a), "an action must be an integer from 0 to 2") for a in (99, -1, "a")),
        (lambda: act_in_the_house("a"), "an action must be an array of numbers"),
        *((lambda n=n: GridTargetsVector(n), "num_envs must be an integer from 1 to 100000") for n in (0, 100_001)),
        (lambda: GridHousesVector([TINY], 0), "num_envs must be an integer from 1 to 100000, got"),
        (lambda: GridTargetsVector(1, house=TINY, slots=(2, 1001)), "slots must be at most 1,000 of a kind, got"),
        (lambda: GridHousesVector([]), "houses must be at least 1"),
        (lambda: GridHousesVector([TINY], 2, render_mode="rgb_array"), "render_mode must be None"),
        *((lambda a=a: act(a), "an action must be one integer, got") for a in (np.array([1]), [1, 2])),
        (lambda: step_vector(np.zeros((3, 1), int)), "actions must be 3 integers, one for each episode"),
        (lambda: step_vector(np.zeros(3, int), 3.5), "the seed must be an integer, or one for each of 3"),
        (lambda: step_vector(np.zeros(3, int), [1, 2]), "seeds must be 3, one for each episode, got 2"),
        *((lambda h=h: GridHousesVector(h, 2), "houses must be several") for h in ("paper", TINY)),
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
