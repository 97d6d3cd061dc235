"""What nobody would give to the public constructors on purpose: a line that says what is wrong, and no other error."""

import dataclasses
import functools

import gymnasium
import numpy as np
import pytest

import caregiver_mj
from caregiver_mj import FloorPlan
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
from caregiver_mj.viz.film import Picture, render_episode
from caregiver_mj.viz.report import write_report

TEXT = "######\n#B.S.#\n#....#\n#C..T#\n######"
TINY = FloorPlan.parse(TEXT, "tiny")


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


def film(**options):
    render_episode("film.mp4", **{"spec": EpisodeSpec(TINY, caregiver="paper"), "quiet": True} | options)


def pictured(**options):
    film(picture=Picture(**options))


def wish(wishes):
    design(Request(0, **wishes))


def plan():
    return TINY


def novice(epsilon):
    Novice(TINY, epsilon)


def attentive(how):
    find_caregiver(f"attentive:{how}")


def choosing(name):
    record(**CHOOSE, caregiver=name)


def drawn(shape):
    make(observation="map", shape=shape)


def step_vector(actions=(0, 0, 0), seed=0):
    envs = GridTargetsVector(3, house=TINY)
    envs.reset(seed=seed)
    envs.step(actions)


ONE = [RandomStream.draw_group(np.random.RandomState(0), 1, timesteps=2)]
PAPER = FloorPlan.load("paper")
GATES = FloorPlan.parse("#######\n#B...G#\n#.....#\n#######", "gates")
CLOSET, HALL = FloorPlan.parse("####\n#.B#\n####"), FloorPlan.parse("#####\n#..B#\n#####")
VECTOR = "caregiver_mj/Supervise-Targets-v0"
CHEAP = FloorPlan.load("paper", damage="1:1:1")
OTHER_DAMAGE = FloorPlan.parse(TEXT, "tiny", damage="1:9:1")
UNFIT = (".4:none", ".4:driver", ".4:person", ".4:chat:model", ".4:http://a", ".4:attentive:.5")
REAL_TIME = {"world": "grid", "caregiver": "http://[::1]:9", "queries": Queries(thinking="real-time")}
CHOOSE = {"world": "grid", "task": "targets", "task_kwargs": {}}
NO_HAZARDS = {"stairwells": 0, "candles": 0, "batteries": 0}
PARSE = functools.partial(FloorPlan.parse, TEXT)
# A call, the argument that is wrong (or the only one there is), what the error says of it, and values that it refuses.
WRONG = [
    (load, "house", "a house, if no FloorPlan, must be a str or PathLike|cannot be read", 3, "a\0b"),
    (load, "epsilon", "children must be an epsilon", None, 10**400),
    (load, "epsilon", "name of a child must be a str|children must be at least 1", ChildSpec(0.5, 5), []),
    (load, "epsilon", "epsilon must be in", np.array([0.5, 7.0])),
    (load, "epsilon", "failed as it was made: RuntimeError: mine .*test_odd", f"{__name__}:FailingChild:0.5"),
    (load, "random", "must be an integer from 0 to 4294967295", -1, 1.5, 2**32, "3"),
    (load, "task_kwargs", "task_kwargs must be a dict or None", [1]),
    (load, "environment_kwargs", "must be without time_limit: give it in task_kwargs", {"time_limit": 3}),
    (load, "house", r"cells must be of 0\.75 m in a house with gates, got 1", cell_size(GATES, 1.0)),
    (task, "embodiment", r"robot must be a name \(mobile_fr3, mobile_ur5e\) or an", 3),
    (task, "colour", "task_kwargs: got an unexpected keyword argument 'colour'", "red"),
    (task, "candle_offset", "candle_offset, in metres, must be in 0 to 0.27, got 5", 5),
    (task, "control_timestep", "control_timestep must be positive and no longer than a child's move, 1.69 s", 0, 3.0),
    (task, "control_timestep", "multiple of physics timestep", 0.007),
    (task, "compliant_children", "compliant_children must be a bool, got 'x'", "x"),
    (task, "random", "random must be given once", 5),
    (task, "table_height", "table_height must be a height in 0.45", 0.3, (0.7, 0.5), (), "low", (0.5, None)),
    (task, "sensing", "sensing has no 'cat'|sensing must be a Sensing or a dictionary", {"cat": {}}, "x"),
    (task, "sensing", "base must be a Blur or a dict|base has no 'blur'", {"base": None}, {"base": {"blur": 1}}),
    (task, "sensing", r"delay must be in 0 to .* got \[\]", {"delay": []}),
    (task, "sensing", r"\.noise must be 0 or more, got", {"base": {"noise": "x"}}, {"child": {"noise": -0.1}}),
    (task, "sensing", "child.dropout must be in 0 to 0.95, got 1.0", {"child": {"dropout": 1.0}}),
    (task, "sensing", "candle.velocity_noise must be left out", {"candle": {"velocity_noise": 0.1}}),
    (Sight.of, "", "sight must be all, ", "", "rooms", "rooms:", "rooms:-1", "walls:1", "all:", "door"),
    (novice, "", r"epsilon must be in \[0, 1\], got", -0.01, 1.01, np.nan, np.inf),
    (ChildGroup.parse, "", r"children must be the epsilon of each|epsilon must be in \[0, 1\]", "", "0.5;1", "1.5"),
    (ChildGroup.parse, "", "'mine:Child' cannot be loaded: ModuleNotFoundError", "mine:Child:0.5"),
    (ChildGroup.parse, "", r"child 'json:loads' \(yours\) must be a subclass of", "json:loads:0.5"),
    (ChildGroup.parse, "", "no child 'angel': there are novice, .* and yours as module:object", "angel:0.5"),
    (FloorPlan.parse, "", "text of a floor plan must be a str", None),
    (FloorPlan.load, "", "house-1111", "test-100/house-" + "1" * 5000),
    (PARSE, "name", "name of a floor plan must be a str", None),
    (PARSE, "damage", "damage, if no DamageWeights or mapping, must be a str", 3),
    (PARSE, "cell_size", "cell size must be above 0 and at most 1.1 m", None, np.nan, 0, 1.2, 1000.0),
    (DamageWeights, "", r"the damage of a stairwell must be in 0 to 1e\+06, got", "a", -1, 1e308, np.inf, np.nan),
    (DamageWeights.of, "", "no kind of damage 'stove': there are stairwell,", "stove=3", {"stove": 3}),
    (DamageWeights.of, "", "must name each kind once, got 'candle=3,candle=4'", "candle=3,candle=4"),
    (DamageWeights.of, "", "must be KIND=NUMBER, such as stairwell=5,.* got 'candle=3:4'", "candle=3:4"),
    (DamageWeights.of, "", "the damage of a candle must be in 0 to 1e", "candle=-1"),
    (generate, "", "cannot be made: the seed must be an integer", 1.5),
    (wish, "", "size must be columns and rows", {"size": (10,)}),
    (wish, "", "cannot be made: rows and columns must be 5 to 100", {"size": (10.5, 10)}, {"size": (4, 10)}),
    (wish, "", "cannot be made: rooms must be at least 1, got 0", {"rooms": 0}),
    (wish, "", "nothing to protect a child from", {"stairwells": 0, "candles": 0}, {"stairwells": 0, "tables": 0}),
    (wish, "", "nothing to protect a child from", {**NO_HAZARDS, "home": True}),
    (wish, "", "there is nowhere to take it", {"candles": 2, "tables": 0}),
    (wish, "", "no way was found to fit .*, gates 40, .* into 12 x 12 cells", {"size": (12, 12), "gates": 40}),
    (wish, "", "no way was found to fit rooms 30, .* into 9 x 9 cells", {"size": (9, 9), "rooms": 30}),
    (house_set, "", "no set of floor plans '.*': there are train-N, test-N", 3, "test", "test-", "drawn-10@secret"),
    (house_set, "", "a set has 1 to 10(00)? houses", "test-0", "train-1001", "drawn-11"),
    (policy, "", "a caregiver must be a str or Caregiver", 3),
    (attentive, "", "attenti", "often", "1.5", *UNFIT),
    (verb_of, "", "no verb 'tickle': there are block, close, relocate, pick up, .*, nothing", "tickle"),
    (find_embodiment, "", "failed as it was made: RuntimeError: mine .*test_odd", f"{__name__}:failing"),
    (find_embodiment, "", "must be a function that makes an Embodiment, got '#", f"{__name__}:TEXT"),
    (find_embodiment, "", r"cannot be called with \(\): missing", f"{__name__}:cell_size"),
    (find_embodiment, "", "must be an Embodiment, got FloorPlan", f"{__name__}:plan"),
    (ask, "max_calls", "max_calls must be an integer of at least 0, got -1", -1),
    (ask, "max_tokens", "max_tokens must be an integer of at least 0, got 0.5", 0.5),
    (ask, "patience", "patience, in seconds, must be in 0 to 8.64", np.nan, np.inf, "soon"),
    (ask, "thinking", "thinking must be waits or real-time, got 'fast'", "fast"),
    (ask, "frames", "frames must be a bool, got 1", 1),
    (act_with, "", "'mine' must answer with 11 finite numbers, got", lambda _: None, lambda _: np.full(11, np.nan)),
    (settings, "plans", "a house must be a FloorPlan|houses must be at least 1, all different", "paper", (TINY, TINY)),
    (settings, "plans", "damage must be the same in all houses, got 1:1:1 and 5:4:1", (TINY, CHEAP)),
    (settings, "caregivers", "caregivers must be at least 1, all different", ()),
    (settings, "families", "all different", (0.5, 0.5)),
    (settings, "families", "no child 'angel'", (ChildGroup((ChildSpec(0.5, "angel"),)),)),
    (settings, "episodes", "episodes must be an integer of at least 1", 1.5),
    (settings, "seed", "seed must be an integer of at least 0", -1),
    (check, "world", "no world 'moon': there are house, grid", "moon"),
    (check, "task", "no task 'fly': there are supervise, .*, targets", "fly"),
    (check, "episode", "episode must be an integer of at least 0, got -1", -1),
    (check, "seed", "seed must be an integer of at least 0, got 0.5", 0.5),
    (choosing, "", "got 'childproof', which has its own prepare, destination$", "childproof"),
    (choosing, "", "no more than choose .* its own decide, destination$", "foresight"),
    (choosing, "", "which has its own yields$", "studies.ablations:Still"),
    (make, "world", "no world 'moon': there are house, grid", "moon"),
    (make, "render_mode", "no render mode 'human', which needs a window: take rgb_array", "human"),
    (make, "observation", "no observation 'camera': there are numbers, flat, map, graph", "camera"),
    (drawn, "", r"shape must be .*at least \(5, 6\) for house 'tiny'", (4, 9)),
    (drawn, "", "shape must be .*(rows and columns|at most 1,000 of a kind)", (9,), (9, 1001)),
    (film, "still", "must be called FILE.png", "still.jpg"),
    (film, "seconds", "seconds must be a positive", float("nan")),
    (film, "overlay", "must predict|no overlay 'rain': there is danger", "danger", "rain"),
    (pictured, "width", "width must be an even number", 321),
    (pictured, "fps", "fps must be in", 0.0),
    (pictured, "camera", "no camera 'nowhere': there are eye, follow, ", "nowhere"),
    (step_vector, "seed", "seed must be an integer, or one for each of 3|seeds must be 3, one for each", 3.5, [1, 2]),
]
# Calls in which what is wrong is more than one argument, or the moment.
ODD = [
    (lambda: policy_of("knows-goal", sight="walls"), "sight must be all with a caregiver that needs privileged"),
    (lambda: load("block_stairs", cell_size(PAPER, 0.5)), r"cells of at least 0\.54 m, as wide as the robot, got"),
    (lambda: load("relocate_candle", GATES), r"relocate_candle needs a candle \(C\), .* 'gates' has none"),
    (lambda: load("relocate_candle", task_kwargs={"robot": False}), "relocate_candle needs the robot"),
    (lambda: load(house=CLOSET, epsilon=0.5), "must have at least 2 free cells, for children and robot, got 1"),
    (lambda: load(house=HALL, epsilon="1,1"), "must have at least 3 free cells, for children and robot, got 2"),
    (lambda: policy_of("nearest", control_timestep=0.08), r"control_timestep must be at most 0.06 s .*, got 0\.08"),
    (lambda: load().physics.render(48, 64), "visuals=True"),
    (lambda: load().physics.copy().render(48, 64), "visuals=True"),
    (lambda: film(spec=EpisodeSpec(TINY, caregiver="none"), overlay="danger"), "must predict"),
    (lambda: PaperCaregiver(TINY, expert_timesteps=-1), "timesteps of experts must be at least 0, got -1"),
    (lambda: policy("random", -1), "seed of a caregiver must be an integer of at least 0"),
    (lambda: caregiver_mj.CaregiverPolicy(None), "got NoneType"),
    (lambda: caregiver_mj.CaregiverPolicy(make("BlockStairs")), "env.unwrapped.dm_env"),
    (lambda: make_caregiver(f"{__name__}:Failing", TINY), "failed as it was made: RuntimeError: mine .*test_odd"),
    (lambda: AllLayouts(64, 1), "tables must be at most 63 to plan for candles, got 64"),
    (lambda: make_caregiver(None, TINY), "name of a caregiver must be a str"),
    (lambda: make_caregiver("paper", "paper"), "house of a caregiver must be a FloorPlan"),
    (lambda: policy()(load().reset().observation), "must be given the time step of env.step or .*, got dict"),
    (act_in_mid_episode, "first time step that a caregiver's policy sees must be that of env.reset"),
    (lambda: decide("relocate", 0, 1), r"decide: 'relocate' must be for a candle or mug, \[1\], got hazard 0"),
    (lambda: decide("close", 0, NOTHING), "'close' must be for a gate, .* got hazard 0"),
    (lambda: decide("block", 1, NOTHING), "'block' must be for a stairwell, .* got hazard 1"),
    (lambda: decide("block", NOTHING, NOTHING), "'block' must be for a stairwell, .* got hazard -1"),
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
    (lambda: check(world="grid", task="block_stairs"), "task must be supervise or targets in the grid"),
    (lambda: check(world="grid", task_kwargs={"time_limit": 1.0}), "with no task_kwargs"),
    (lambda: check(world="grid", task="targets", child_speed=0.8), "child_speed must be 0.444 m/s in the grid"),
    (lambda: check(**REAL_TIME, child_speed=0.8), "child_speed must be 0.444 m/s in the grid"),
    (lambda: check(caregiver="http://127.0.0.1:9", queries=Queries(max_calls=-1)), "max_calls must be"),
    (lambda: record(world="grid", task_kwargs={}), "task must be targets in the grid, got 'supervise'"),
    (lambda: record(world="grid", task="targets"), "cameras and seconds must be left out in the grid"),
    (lambda: record(task="targets"), "seconds must be left out with targets"),
    (lambda: record(caregiver="none"), "caregiver must be one that acts, got 'none'"),
    (lambda: record(task="targets", task_kwargs={}, caregiver="knows-goal"), "needs privileged information"),
    (lambda: evaluate(Settings(TINY, "grid", episodes=1), jobs="a"), "jobs must be an integer of at least 1"),
    (lambda: write_report([]), "at least 1 run"),
    (lambda: pool_runs([], "nowhere"), "at least 2, got 0"),
    (lambda: Settings(()).plan, "houses must be 1, got 0"),
    (lambda: evaluate(Settings(TINY, "grid", episodes=1), "DIR"), "folder must be a RunFolder or None, got"),
    (lambda: make(world="grid", camera="wrist"), "must be left out in the grid"),
    (lambda: make(render_mode="rgb_array", width=8), "the width of a picture, .* must be .* from 32 to 1920"),
    (lambda: gymnasium.make_vec(VECTOR, 2, world="house"), "vectorization_mode='sync'"),
    (lambda: gymnasium.make_vec(VECTOR, 2, world="moon"), "no world 'moon'"),
    (lambda: gymnasium.make_vec(VECTOR, 2, task_kwargs={"sight": "walls"}), "task_kwargs and camera must be left out"),
    (lambda: make(task_kwargs={"sight": "walls"}), "task_kwargs and camera must be left out"),
    (lambda: act(make(), 99), "an action must be an integer from 0 to 2"),
    (lambda: act(make("BlockStairs"), "a"), "an action must be an array of numbers"),
    (lambda: act(make(), [1, 2]), "an action must be one integer, got"),
    (lambda: step_vector(np.zeros((3, 1), int)), "actions must be 3 integers, one for each episode"),
    (lambda: GridTargetsVector(100_001), "num_envs must be an integer from 1 to 100000"),
    (lambda: GridTargetsVector(1, house=TINY, slots=(2, 1001)), "slots must be at most 1,000 of a kind, got"),
    (lambda: GridHousesVector([TINY], 0), "num_envs must be an integer from 1 to 100000, got"),
    (lambda: GridHousesVector([]), "houses must be at least 1"),
    (lambda: GridHousesVector([TINY], 2, render_mode="rgb_array"), "render_mode must be None"),
    (lambda: GridHousesVector(TINY, 2), "houses must be several"),
    (lambda: GridHousesVector([TINY], 2, families=0.5), "families must be several, such as"),
    (lambda: GridHousesVector([TINY], 2, families=("1", "1,.5")), "child groups must be of the same size"),
    (lambda: GridHousesVector([TINY], 3, 2), "at_once, .* must be an integer from 1 to 1, got 2"),
    (lambda: GridHousesVector([TINY, "paper"], 3), "must be a multiple of 2 houses at once x 1 families, got 3"),
]
ODD += [
    (functools.partial(call, **{name: value}) if name else functools.partial(call, value), words)
    for call, name, words, *values in WRONG
    for value in values
]


@pytest.mark.parametrize(("call", "words"), ODD, ids=[words[:40] for _, words in ODD])
def test_refused_in_a_line(call, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(CaregiverError, match=words) as error:
        call()
    assert "\n" not in str(error.value)
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize("make", [lambda: GridTargetsVector(2, house=TINY), lambda: GridHousesVector([TINY], 2)])
def test_a_vector_must_be_reset_first(make):
    with pytest.raises(gymnasium.error.ResetNeeded):
        make().step(np.zeros(2, int))
