"""What nobody would give to the public constructors on purpose: a line that says what is wrong, and no other error."""

import gymnasium
import numpy as np
import pytest

import caregiver_mj
from caregiver_mj.caregivers import CAREGIVERS, make_caregiver
from caregiver_mj.children.family import Family
from caregiver_mj.children.tape import Tape
from caregiver_mj.envs.houses_vector import GridHousesVector
from caregiver_mj.envs.target_grid import GridTargetsVector
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.grid.world import GridWorld, run_episodes
from caregiver_mj.plans.generator import generate
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.plans.sets import house_set, houses_named
from caregiver_mj.viz.film import render_episode
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


def run(tapes, children="1"):
    GridWorld(TINY, children, None).run(tapes)


ONE = [Tape.draw_family(np.random.RandomState(0), 1, timesteps=2)]

ODD = {
    "load": [
        (lambda: load(["supervise"]), "no task"),
        *((lambda house=house: load(house=house), "must be a str or PathLike") for house in (None, 3, b"paper")),
        (lambda: load(house=""), "cannot be read"),
        (lambda: load(house="a\0b"), "cannot be read"),
        (lambda: load(house="x" * 5000), "cannot be read"),
        *((lambda e=e: load(epsilon=e), "children are said by an epsilon") for e in (None, {}, 1j)),
        (lambda: load(epsilon=[]), "at least one child"),
        (lambda: load(epsilon=np.array([0.5, 7.0])), "epsilon must lie in"),
        *((lambda r=r: load(random=r), "must be an integer from 0 to 4294967295") for r in ("a", 1.5, -1, 2**40)),
        (lambda: load(task_kwargs=[1]), "task_kwargs must be a dict or None"),
        (lambda: load(environment_kwargs="a"), "environment_kwargs must be a dict or None"),
    ],
    "floor plan": [
        *(
            (lambda t=t: caregiver_mj.FloorPlan.parse(t), "text of a floor plan must be a str")
            for t in (None, b"#", [])
        ),
        *((lambda c=c: caregiver_mj.FloorPlan.parse(TEXT, cell_size=c), "cell size") for c in (None, "a", 0, np.nan)),
        (lambda: caregiver_mj.FloorPlan.parse(TEXT, None), "name of a floor plan must be a str"),
        (lambda: caregiver_mj.FloorPlan.parse(TEXT, damage=3), "damage must be a DamageWeights"),
        *((lambda d=d: DamageWeights(d), "damage of a stairwell must be a number") for d in ("a", None, -1, np.inf)),
        *((lambda s=s: generate(s), "the seed must be an integer") for s in ("a", 1.5, None)),
        *((lambda s=s: generate(0, s), "the size is columns and rows") for s in (5, "14x12", (10,))),
        (lambda: generate(0, (10.5, 10)), "5 to 100 rows and columns, not 10.5"),
        (lambda: generate(0, rooms=2.5), "rooms must be at least 1"),
        (lambda: generate(0, candles="a"), "candles must be at least 0"),
        (lambda: house_set(3), "no set of floor plans"),
    ],
    "caregiver": [
        (lambda: policy(3), "a caregiver must be a str or Caregiver"),
        (lambda: policy(CAREGIVERS["paper"]), "a caregiver must be a str or Caregiver"),
        (lambda: policy("random", -1), "seed of a caregiver must be an integer of at least 0"),
        (lambda: caregiver_mj.CaregiverPolicy(None), "not for NoneType"),
        (
            lambda: caregiver_mj.CaregiverPolicy(gymnasium.make("caregiver_mj/BlockStairs-v0", house=TINY)),
            "env.unwrapped.dm_env",
        ),
        (lambda: make_caregiver(None, TINY), "name of a caregiver must be a str"),
        (lambda: make_caregiver("paper", "paper"), "house of a caregiver must be a FloorPlan"),
        (lambda: make_caregiver("random", TINY, "x"), "seed of a caregiver must be an integer"),
    ],
    "grid": [
        (lambda: GridWorld("paper", 0.5, None), "house must be a FloorPlan, .* FloorPlan.load makes one"),
        (lambda: GridWorld(TINY, 0.5, "paper"), "must be a Caregiver or None, .* make_caregiver makes one"),
        (lambda: run([]), "at least one episode"),
        (lambda: run(ONE, "1,1"), "a tape for each of 2 children"),
        (lambda: run_episodes(TINY, 0.5, None, [-1]), "seed of an episode must be an integer from 0"),
        (lambda: run_episodes(TINY, 0.5, None, ["a"]), "seed of an episode must be an integer from 0"),
        (lambda: Family.of(None), "children are said by an epsilon"),
    ],
    "run": [
        (lambda: settings(plans="paper"), "a house must be a FloorPlan"),
        *((lambda n=n: settings(episodes=n), "episodes must be an integer of at least 1") for n in ("a", 1.5, 0)),
        *((lambda s=s: settings(seed=s), "seed must be an integer of at least 0") for s in ("a", 0.5, -1)),
        (lambda: evaluate(Settings(TINY, "grid", episodes=1), jobs="a"), "jobs must be an integer of at least 1"),
        (lambda: write_report([]), "at least one run"),
        (lambda: write_report("nowhere"), "'nowhere' holds no run"),
    ],
    "film": [
        *((lambda p=p: render_episode(p), "a file must be a str or PathLike") for p in (None, 3)),
        (lambda: render_episode("a.mp4", width="a"), "width must be an even number of pixels"),
        (lambda: render_episode("a.mp4", fps="a"), "fps must lie in"),
        (lambda: render_episode("a.mp4", seconds="a"), "seconds must be a positive length"),
        (lambda: render_episode("a.mp4", seed="a"), "seed must be an integer"),
    ],
    "environment": [
        *((lambda a=a: act(a), "an action is an integer from 0 to 2") for a in (99, -1, "a", None, 1.5)),
        (lambda: act_in_the_house("a"), "an action is an array of numbers"),
        *((lambda n=n: GridTargetsVector(n), "num_envs must be an integer of at least 1") for n in (0, -1, "a")),
        (lambda: GridHousesVector([]), "a house at least"),
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


def test_one_name_is_not_its_letters():
    assert len(houses_named("test-2")) == 2


def test_children_in_an_array():
    assert Family.of(np.array([0.5, 1.0])) == Family.of([0.5, 1.0]) == Family.parse("0.5,1")
