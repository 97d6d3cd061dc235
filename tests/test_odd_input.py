"""What nobody would give to the public constructors on purpose: a line that says what is wrong, and no other error."""

import dataclasses

import gymnasium
import numpy as np
import pytest

import caregiver_mj
from caregiver_mj.caregivers import Caregiver, make_caregiver
from caregiver_mj.caregivers.foresight.value_table import AllLayouts
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.registry import find_caregiver
from caregiver_mj.caregivers.server import Queries
from caregiver_mj.children.child_group import ChildGroup, ChildSpec
from caregiver_mj.children.novice import Novice
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.envs.houses_vector import GridHousesVector
from caregiver_mj.envs.recipe import Recording
from caregiver_mj.envs.target_grid import GridTargetsVector
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.finished import pool_runs
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.grid.world import GridWorld, run_episodes
from caregiver_mj.interventions.verb import Intervention, Interventions, verb_of
from caregiver_mj.plans.generator import Request, design, generate
from caregiver_mj.plans.hazards import NOTHING, DamageWeights
from caregiver_mj.plans.sets import house_set
from caregiver_mj.plans.visibility import Sight
from caregiver_mj.policy.own import OwnPolicy
from caregiver_mj.robot.embodiments import find_embodiment
from caregiver_mj.viz.report import write_report

TEXT = "######\n#B.S.#\n#....#\n#C..T#\n######"
TINY = caregiver_mj.FloorPlan.parse(TEXT, "tiny")


def load(task="supervise", house=TINY, **options):
    return caregiver_mj.load(task, house, **{"random": 0, "visuals": False} | options)


def task(**options):
    load(task_kwargs=options)


def cell_size(plan, metres):
    return dataclasses.replace(plan, cell_size=metres)


def policy(*arguments):
    return caregiver_mj.CaregiverPolicy(load(), *arguments)


def settings(**options):
    return Settings(**{"plans": (TINY,), "world": "grid", "episodes": 1} | options).check()


def check(**options):
    EpisodeSpec(TINY, **options).check()


def record(**options):
    Recording(EpisodeSpec(TINY, 0.5, task_kwargs=options.pop("task_kwargs", {"time_limit": 1.0}), **options)).spaces()


def ask(**options):
    make_caregiver("http://127.0.0.1:1", TINY, 0, Queries(**options))


def make(name="Supervise-Targets", **options):
    return gymnasium.make(f"caregiver_mj/{name}-v0", house=TINY, **options)


def act(env, action):
    env.reset(seed=0)
    env.step(action)


def run(streams, children="1"):
    GridWorld(TINY, children, None).run(streams)


def move_after_the_end():
    world = GridWorld(TINY, "1", None)
    world.run(ONE)
    world.move_children()


def policy_of(name, **options):
    caregiver_mj.CaregiverPolicy(load(task_kwargs=options), name)


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
GATES = caregiver_mj.FloorPlan.parse("#######\n#B...G#\n#.....#\n#######", "gates")
HEIGHTS = (0.3, (0.7, 0.5), (), "low", (0.5, None))
CHEAP = caregiver_mj.FloorPlan.load("paper", damage="1:1:1")
NO_HAZARDS = {"stairwells": 0, "candles": 0, "batteries": 0}
SIGHTS = ("", "rooms", "rooms:", "rooms:-1", "walls:1", "all:", "door")
UNFIT = (".4:none", ".4:driver", ".4:person", ".4:chat:model", ".4:http://a", ".4:attentive:.5")
REAL_TIME = {"world": "grid", "caregiver": "http://[::1]:9", "queries": Queries(thinking="real-time")}
CHOOSE = {"world": "grid", "task": "targets", "task_kwargs": {}}
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
        *((lambda x=x: load(random=x), "must be an integer from 0 to 4294967295") for x in (-1, 1.5, 2**32, "3")),
        (lambda: load(task_kwargs=[1]), "task_kwargs must be a dict or None"),
        (lambda: policy_of("knows-goal", sight="walls"), "sight must be all with a caregiver that needs privileged"),
        (lambda: load("block_stairs", cell_size(PAPER, 0.5)), r"cells of at least 0\.54 m, as wide as the robot, got"),
        (lambda: load(house=cell_size(GATES, 1.0)), r"cells must be of 0\.75 m in a house with gates, got 1"),
        (lambda: load("relocate_candle", GATES), r"relocate_candle needs a candle \(C\), .* 'gates' has none"),
        (lambda: load("relocate_candle", task_kwargs={"robot": False}), "relocate_candle needs the robot"),
        (lambda: load(environment_kwargs={"time_limit": 3}), "must be without time_limit: give it in task_kwargs"),
        (lambda: task(embodiment=3), r"robot must be a name \(mobile_fr3, mobile_ur5e\) or an"),
        (lambda: task(colour="red"), "task_kwargs: got an unexpected keyword argument 'colour'"),
        (lambda: task(candle_offset=5), "candle_offset, in metres, must be in 0 to 0.27, got 5"),
        (lambda: task(control_timestep=0), "control_timestep must be positive .* got 0"),
        (lambda: task(control_timestep=3.0), "no longer than a child's move, 1.69 s, got 3.0"),
        (lambda: task(control_timestep=0.007), "multiple of physics timestep"),
        (lambda: task(compliant_children="x"), "compliant_children must be a bool, got 'x'"),
        (lambda: task(random=5), "random must be given once"),
        *((lambda x=x: task(table_height=x), r"table_height must be a height in 0\.45 to 0\.75 m") for x in HEIGHTS),
        (lambda: task(sensing={"cat": {}}), "sensing has no 'cat': there are candle, child, base, delay"),
        (lambda: task(sensing="x"), "sensing must be a Sensing or a dictionary, got 'x'"),
        (lambda: task(sensing={"base": None}), "sensing: base must be a Blur or a dictionary, got None"),
        (lambda: task(sensing={"delay": []}), r"sensing: delay must be in 0 to .* got \[\]"),
        (lambda: task(sensing={"base": {"noise": "x"}}), "base.noise must be 0 or more, got 'x'"),
        (lambda: task(sensing={"base": {"blur": 1}}), "sensing: base has no 'blur': there are noise, bias"),
        (lambda: task(sensing={"child": {"noise": -0.1}}), "child.noise must be 0 or more, got -0.1"),
        (lambda: task(sensing={"child": {"dropout": 1.0}}), "child.dropout must be in 0 to 0.95, got 1.0"),
        (lambda: task(sensing={"candle": {"velocity_noise": 0.1}}), "candle.velocity_noise must be left out"),
        *((lambda s=s: Sight.of(s), "sight must be all, walls, camera or rooms:N, got") for s in SIGHTS),
    ],
    "children": [
        *((lambda x=x: Novice(TINY, x), r"epsilon must be in \[0, 1\], got") for x in (-0.01, 1.01, np.nan, np.inf)),
        (lambda: ChildGroup.parse(""), "children must be the epsilon of each, such as 0.5 or .* adversary:0.5, got ''"),
        (lambda: ChildGroup.parse("0.5;1"), "got '0.5;1'"),
        (lambda: ChildGroup.parse("1.5"), r"epsilon must be in \[0, 1\], got 1.5"),
        (lambda: ChildGroup.parse("mine:Child:0.5"), "'mine:Child' cannot be loaded: ModuleNotFoundError"),
        (lambda: ChildGroup.parse("json:loads:0.5"), r"child 'json:loads' \(yours\) must be a subclass of"),
        (lambda: ChildGroup.parse("angel:0.5"), "no child 'angel': there are novice, .* and yours as module:object"),
    ],
    "floor plan": [
        (lambda: caregiver_mj.FloorPlan.parse(None), "text of a floor plan must be a str"),
        *(
            (lambda x=x: caregiver_mj.FloorPlan.parse(TEXT, cell_size=x), "cell size must be above 0 and at most 1.1 m")
            for x in (None, np.nan, 0, 1.2, 1000.0)
        ),
        (lambda: caregiver_mj.FloorPlan.load("test-100/house-" + "1" * 5000), "house-1111"),
        (lambda: caregiver_mj.FloorPlan.parse(TEXT, None), "name of a floor plan must be a str"),
        (lambda: caregiver_mj.FloorPlan.parse(TEXT, damage=3), "damage, if no DamageWeights or mapping, must be a str"),
        *(
            (lambda x=x: DamageWeights(x), r"the damage of a stairwell must be in 0 to 1e\+06, got")
            for x in ("a", -1, 1e308, np.inf, np.nan)
        ),
        (lambda: generate(1.5), "the seed must be an integer"),
        (lambda: generate(0, (10,)), "size must be columns and rows"),
        (lambda: generate(0, (10.5, 10)), "rows and columns must be 5 to 100, got 10.5"),
        (lambda: design(Request(0, (4, 10))), "^floor plan 'house-0-4x10' cannot be made: rows and columns must be 5"),
        (lambda: design(Request(0, rooms=0)), "cannot be made: rooms must be at least 1, got 0"),
        (lambda: design(Request(0, stairwells=0, candles=0)), "there is nothing to protect a child from"),
        (lambda: design(Request(0, stairwells=0, tables=0)), "there is nothing to protect a child from"),
        (lambda: design(Request(0, **NO_HAZARDS, home=True)), "there is nothing to protect a child from"),
        (lambda: design(Request(0, candles=2, tables=0)), "there is nowhere to take it"),
        (lambda: design(Request(0, (12, 12), gates=40)), "no way was found to fit .*, gates 40, .* into 12 x 12 cells"),
        (lambda: design(Request(0, (9, 9), rooms=30)), "no way was found to fit rooms 30, .* into 9 x 9 cells"),
        (lambda: house_set(3), "no set of floor plans"),
        (lambda: house_set("test"), "no set of floor plans 'test': there are train-N, test-N, .*such as test-100"),
        (lambda: house_set("test-"), "no set of floor plans 'test-': there are train-N, test-N"),
        (lambda: house_set("test-0"), "a set has 1 to 1000 houses"),
        (lambda: house_set("train-1001"), "a set has 1 to 1000 houses"),
        (lambda: house_set("drawn-11"), "a set has 1 to 10 houses"),
        (lambda: house_set("drawn-10@secret"), "there are train-N, test-N"),
        (lambda: DamageWeights.of("stove=3"), "no kind of damage 'stove': there are stairwell, .*, gate, mug, battery"),
        (lambda: DamageWeights.of({"stove": 3}), "no kind of damage 'stove'"),
        (lambda: DamageWeights.of("candle=3,candle=4"), "must name each kind once, got 'candle=3,candle=4'"),
        (lambda: DamageWeights.of("candle=3:4"), "must be KIND=NUMBER, such as stairwell=5,.* got 'candle=3:4'"),
        (lambda: DamageWeights.of("candle=-1"), "the damage of a candle must be in 0 to 1e"),
    ],
    "caregiver": [
        (lambda: policy(3), "a caregiver must be a str or Caregiver"),
        *((lambda x=x: find_caregiver(f"attentive:{x}"), "attenti") for x in ("often", "1.5", *UNFIT)),
        (lambda: PaperCaregiver(TINY, expert_timesteps=-1), "timesteps of experts must be at least 0, got -1"),
        (lambda: verb_of("tickle"), "no verb 'tickle': there are block, close, relocate, pick up, .*, nothing"),
        (lambda: ask(max_calls=-1), "max_calls must be an integer of at least 0, got -1"),
        (lambda: ask(max_tokens=0.5), "max_tokens must be an integer of at least 0, got 0.5"),
        *(
            (lambda x=x: ask(patience=x), "patience, in seconds, must be in 0 to 8.64")
            for x in (np.nan, np.inf, "soon")
        ),
        (lambda: ask(thinking="fast"), "thinking must be waits or real-time, got 'fast'"),
        (lambda: ask(frames=1), "frames must be a bool, got 1"),
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
            "must be given the time step of env.step or .*, got dict",
        ),
        (act_in_mid_episode, "first time step that a caregiver's policy sees must be that of env.reset"),
        (lambda: decide("relocate", 0, 1), r"decide: 'relocate' must be for a candle or mug, \[1\], got hazard 0"),
        (lambda: decide("close", 0, NOTHING), "'close' must be for a gate, .* got hazard 0"),
        (lambda: decide("block", 1, NOTHING), "'block' must be for a stairwell, .* got hazard 1"),
        (lambda: decide("block", NOTHING, NOTHING), "'block' must be for a stairwell, .* got hazard -1"),
        (lambda: act_with(lambda timestep: None), "'mine' must answer with 11 finite numbers, got"),
        (lambda: act_with(lambda timestep: np.full(11, np.nan)), "'mine' must answer with 11 finite numbers, got"),
    ],
    "grid": [
        (lambda: GridWorld("paper", 0.5, None), "house must be a FloorPlan, .* FloorPlan.load makes one"),
        (lambda: GridWorld(TINY, 0.5, make_caregiver("knows-goal", TINY), sight="walls"), "sight must be all"),
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
        (lambda: settings(plans=(TINY, TINY)), "houses must be at least 1, all different"),
        (lambda: settings(plans=(TINY, CHEAP)), "damage must be the same in all houses, got 1:1:1 and 5:4:1"),
        (lambda: settings(caregivers=()), "caregivers must be at least 1"),
        (lambda: settings(families=(0.5, 0.5)), "all different"),
        (lambda: settings(families=(ChildGroup((ChildSpec(0.5, "angel"),)),)), "no child 'angel'"),
        (lambda: settings(embodiment="butler"), "no robot 'butler': there are mobile_fr3, mobile_ur5e"),
        (lambda: evaluate(Settings(TINY, "grid", ("nanny",))), "no caregiver 'nanny': there are none, .*, and yours"),
        (lambda: check(world="moon"), "no world 'moon': there are house, grid"),
        (lambda: check(task="fly"), "no task 'fly': there are supervise, .*, targets"),
        (lambda: check(world="grid", task="block_stairs"), "task must be supervise or targets in the grid"),
        (lambda: check(world="grid", task_kwargs={"time_limit": 1.0}), "with no task_kwargs"),
        (lambda: check(world="grid", task="targets", child_speed=0.8), "child_speed must be 0.444 m/s in the grid"),
        (lambda: check(**REAL_TIME, child_speed=0.8), "child_speed must be 0.444 m/s in the grid"),
        (lambda: check(episode=-1), "episode must be an integer of at least 0, got -1"),
        (lambda: check(seed=0.5), "seed must be an integer of at least 0, got 0.5"),
        (lambda: check(caregiver="http://127.0.0.1:9", queries=Queries(max_calls=-1)), "max_calls must be"),
        (lambda: record(world="grid", task_kwargs={}), "task must be targets in the grid, got 'supervise'"),
        (lambda: record(world="grid", task="targets"), "cameras and seconds must be left out in the grid"),
        (lambda: record(task="targets"), "seconds must be left out with targets"),
        (lambda: record(caregiver="none"), "caregiver must be one that acts, got 'none'"),
        (lambda: record(task="targets", task_kwargs={}, caregiver="knows-goal"), "needs privileged information"),
        (lambda: record(**CHOOSE, caregiver="childproof"), "got 'childproof', which has its own prepare, destination$"),
        (lambda: record(**CHOOSE, caregiver="foresight"), "no more than choose .* its own decide, destination$"),
        (lambda: record(**CHOOSE, caregiver="studies.ablations:Still"), "which has its own yields$"),
        (lambda: settings(episodes=1.5), "episodes must be an integer of at least 1"),
        (lambda: settings(seed=-1), "seed must be an integer of at least 0"),
        (lambda: evaluate(Settings(TINY, "grid", episodes=1), jobs="a"), "jobs must be an integer of at least 1"),
        (lambda: write_report([]), "at least 1 run"),
        (lambda: pool_runs([], "nowhere"), "at least 2, got 0"),
        (lambda: Settings(()).plan, "houses must be 1, got 0"),
        (lambda: evaluate(Settings(TINY, "grid", episodes=1), "DIR"), "folder must be a RunFolder or None, got"),
    ],
    "environment": [
        (lambda: make(world="moon"), "no world 'moon': there are house, grid"),
        (lambda: make(world="grid", camera="wrist"), "must be left out in the grid"),
        (lambda: make(render_mode="human"), "no render mode 'human', which needs a window: take rgb_array"),
        (lambda: make(render_mode="rgb_array", width=8), "the width of a picture, .* must be .* from 32 to 1920"),
        (lambda: make(observation="camera"), "no observation 'camera': there are numbers, flat, map, graph"),
        (lambda: make(observation="map", shape=(4, 9)), r"shape must be .*at least \(5, 6\) for house 'tiny'"),
        (lambda: make(observation="map", shape=(9,)), "shape must be .*rows and columns"),
        (lambda: make(observation="map", shape=(9, 1001)), "shape must be .*at most 1,000 of a kind"),
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
