"""Policies of one's own, of targets and of the robot's actions: where they may stand, and what they must answer."""

import importlib.metadata
import json
import pathlib
import re
import sys

import gymnasium
import numpy as np
import pytest

import caregiver_mj
from caregiver_mj import cli
from caregiver_mj.caregivers import TargetPolicy, make_caregiver
from caregiver_mj.caregivers.registry import find_caregiver
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.settings import Settings, episode_seed
from caregiver_mj.grid.world import run_episodes
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.policy.own import OwnPolicy, make_policy
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.viz.episode import Episode

gymnasium.register_envs(caregiver_mj)
TINY = FloorPlan.parse("######\n#B.S.#\n#....#\n#C..T#\n######", "tiny")
BARE = FloorPlan.parse("#####\n#B.S#\n#...#\n#####", "bare")
HERE = __name__
seen = []  # what policies of this file were shown


class Last(TargetPolicy):
    """Protects the children from the last that it can do something about."""

    def act(self, observations, masks):
        seen.append((observations, masks))
        return masks.shape[1] - 1 - masks[:, ::-1].argmax(axis=1)


class Flat(Last):
    slots = (3, 2)
    flat = True


class Still:
    """Does nothing."""

    def __init__(self, env):
        self.action = np.zeros(env.action_spec().shape)
        self.seeds = []

    def reset(self, seed):
        self.seeds.append(seed)

    def __call__(self, timestep):
        return self.action


class Few(Last):
    slots = (1, 0)


class Forgets(Last):
    """Does not call the constructor of its base."""

    def __init__(self, plan, seed):
        pass


class Telling(Still):
    activity = "wait"


def too_short(env):
    return lambda timestep: np.zeros(3)


def no_maker(env):
    return np.zeros(env.action_spec().shape)


def no_numbers(env):
    return lambda timestep: "forwards"


def takes_nothing():
    return lambda timestep: np.zeros(11)


class Unfinished(TargetPolicy):
    """Has no `act`."""


class TakesNothing(Last):
    def __init__(self):
        pass


NUMBER = 3


@pytest.mark.parametrize(("world", "policy"), [("grid", Last), ("house", Flat)])
def test_a_policy_of_targets_meets_what_it_was_trained_in(world, policy):
    seen.clear()
    settings = Settings(TINY, world, (f"{HERE}:{policy.__name__}",), (1.0,), 1)
    row = evaluate(settings).episodes.iloc[0]
    shown = list(seen)
    env = gymnasium.make(
        "caregiver_mj/Supervise-Targets-v0", world=world, house=TINY, epsilon=1.0, flat=policy.flat, slots=policy.slots
    )
    observation, info = env.reset(seed=episode_seed(0, 0))
    ended = False
    for observations, masks in shown:
        assert not ended
        for key in observation if isinstance(observation, dict) else ():
            np.testing.assert_array_equal(observations[key][0], observation[key])
        if policy.flat:
            np.testing.assert_array_equal(observations[0], observation)
        np.testing.assert_array_equal(masks[0], info["action_mask"])
        action = policy.act(None, observations, masks)[0]
        observation, _, _, ended, info = env.step(action)
    assert ended
    assert {key: value for key, value in info["outcome"].items() if np.isscalar(value)} == {
        key: row[key] for key in info["outcome"] if np.isscalar(info["outcome"][key])
    }
    assert row["interventions"] > 0


def test_a_policy_of_actions_is_made_for_its_environment_and_told_the_seed():
    env = caregiver_mj.load("supervise", TINY, 0.5, random=0, task_kwargs={"time_limit": 1.0}, visuals=False)
    made = []
    policy = OwnPolicy("still", lambda env: made.append(Still(env)) or made[0], env)
    for _ in range(2):
        timestep = env.reset()
        while not timestep.last():
            timestep = env.step(policy(timestep))
    assert (len(made), len(set(made[0].seeds))) == (1, 2)
    assert isinstance(make_policy(env, f"{HERE}:Still"), OwnPolicy)
    assert isinstance(make_policy(env, f"{HERE}:Last"), CaregiverPolicy)
    assert isinstance(make_policy(env, "nearest"), CaregiverPolicy)


@pytest.mark.parametrize(
    ("world", "name", "words"),
    [
        ("grid", f"{HERE}:Still", "world must be house for 'test_own_policies:Still', a policy of the robot's actions"),
        ("house", f"{HERE}:no_maker", "must make a policy of an environment, .* got ndarray"),
        ("house", f"{HERE}:too_short", "too_short' must answer with 11 finite numbers, got array"),
        ("house", f"{HERE}:no_numbers", "no_numbers' must answer with 11 finite numbers, got 'forwards'"),
        ("house", f"{HERE}:takes_nothing", r"takes_nothing' cannot be called with \(Environment\): too many"),
        ("grid", f"{HERE}:Unfinished", "'test_own_policies:Unfinished' must have act, got none"),
        ("grid", f"{HERE}:TakesNothing", r"TakesNothing' cannot be called with \(FloorPlan, int\): too many"),
        ("grid", f"{HERE}:NUMBER", "must be a subclass of Caregiver or a function that makes a policy"),
        ("grid", f"{HERE}:Nobody", "cannot be loaded: AttributeError: .* no attribute 'Nobody'"),
        ("grid", "json:Good", r"no attribute 'Good' \(the module is '.*json.__init__\.py'\)$"),
        ("grid", "nobody_at_home:x", "cannot be loaded: ModuleNotFoundError: No module named 'nobody_at_home'"),
        ("grid", "a b:c", "a name must be module:object, got 'a b:c'"),
        ("grid", "nobody", "no caregiver 'nobody': there are none, .* and yours as module:object"),
    ],
)
def test_what_is_none_is_named(world, name, words):
    with pytest.raises(CaregiverError, match=words):
        evaluate(Settings(TINY, world, (name,), (1.0,), 1))


@pytest.mark.parametrize(
    ("world", "name", "words"),
    [
        ("grid", "TakesNothing", r"cannot be called with \(FloorPlan, int\)"),
        ("grid", "Few", "for house 'tiny', got"),
        ("grid", "Forgets", "Forgets has no plan"),
        ("house", "Few", "for house 'tiny', got"),
    ],
)
def test_what_cannot_be_made_is_told_before_the_first_episode(world, name, words):
    episodes = []
    # Some can be made in the first house.
    settings = Settings((BARE, TINY), world, ("none", "nearest", f"{HERE}:{name}"), (1.0,), 1)
    with pytest.raises(CaregiverError, match=words):
        evaluate(settings, progress=episodes.append)
    assert episodes == []


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (np.zeros(2, int), "Answer.act must answer with 1 integers"),
        (0, "Answer.act must answer with 1 integers"),
        (np.array([3]), r"Answer.act must answer with 0 to 2, got \[3\]"),
    ],
)
def test_targets_that_are_none_are_named(answer, words):
    class Answer(TargetPolicy):
        def act(self, observations, masks):
            return answer

    with pytest.raises(CaregiverError, match=words):
        run_episodes(TINY, 0.5, Answer(TINY), [0])


class Trained(Last):
    """Has learned in a house with one stairwell and one candle, and with one child."""

    flat = True

    def act(self, observations, masks):
        weights = np.zeros((23, 3))  # as many numbers as are observed there
        return (observations @ weights).argmax(axis=1)


def trained(env):
    """Has learned where there is one candle."""
    action = np.zeros(env.action_spec().shape)

    def policy(timestep):
        action[:3] = timestep.observation["candle_position"].ravel()
        return action * 0

    return policy


@pytest.mark.parametrize("world", ["grid", "house"])
def test_a_policy_that_was_trained_for_another_house_is_an_error_of_one_line(world, tmp_path, capsys):
    assert evaluate(Settings(TINY, "grid", (f"{HERE}:Trained",), (1.0,), 1)).episodes.damage.size == 1
    (tmp_path / "two.txt").write_text("######\n#B.SC#\n#....#\n#C.TT#\n######")
    policy = {"grid": "Trained", "house": "trained"}[world]
    said = ["evaluate", "--world", world, "--house", str(tmp_path / "two.txt"), "--epsilon", "1", "--episodes", "1"]
    assert cli.main([*said, "--caregiver", f"{HERE}:{policy}"]) == 2
    line = [line for line in capsys.readouterr().err.splitlines() if line.startswith("caregiver-mj: ")][-1]
    assert "failed in house 'two'" in line
    assert "ValueError" in line


def test_a_simulation_driven_apart_is_told(monkeypatch):
    from dm_control.rl.control import PhysicsError

    class Wild(Still):
        def __call__(self, timestep):
            if timestep.observation["clock"] > 1:
                raise PhysicsError("as MuJoCo has it")
            return self.action

    monkeypatch.setattr(sys.modules[HERE], "Still", Wild)
    with pytest.raises(CaregiverError, match=r"'test_own_policies:Still' made the simulation diverge at 1\.7 s of"):
        evaluate(Settings(TINY, "house", (f"{HERE}:Still",), (1.0,), 1))


def test_a_simulation_that_comes_apart_before_the_camera_is_told():
    episode = Episode.load("supervise", TINY, 0.5, caregiver=f"{HERE}:Still")
    episode.run_until(0.1)
    episode.env.physics.data.qvel[:] = 1e12
    with pytest.raises(CaregiverError, match=r"the simulation diverged at 0\.1 s of the episode"):
        episode.run_until(1.0)


def test_policies_of_packages(monkeypatch):
    group = "caregiver_mj.policies"
    entries = [
        importlib.metadata.EntryPoint(name, f"{HERE}:{what}", group)
        for name, what in (("mine", "Last"), ("still", "Still"), ("number", "NUMBER"), ("paper", "Last"))
    ]
    points = importlib.metadata.EntryPoints(entries)
    monkeypatch.setattr(importlib.metadata, "entry_points", lambda group: points.select(group=group))
    assert isinstance(make_caregiver("mine", TINY), Last)
    assert find_caregiver("still") is Still
    assert not issubclass(find_caregiver("paper"), Last)  # the package's own come first
    with pytest.raises(
        CaregiverError, match=r"policy 'number' \(test_own_policies:NUMBER\) must be a subclass of Caregiver or"
    ):
        find_caregiver("number")
    with pytest.raises(CaregiverError, match="must be a subclass of Caregiver, got 'still', a policy"):
        make_caregiver("still", TINY)
    with pytest.raises(CaregiverError, match=r"no caregiver 'nobody': there are none, .*, mine, number, still, and"):
        find_caregiver("nobody")


def test_a_module_that_leaves_the_process_is_named(tmp_path, monkeypatch):
    (tmp_path / "leaves_at_once.py").write_text("import sys\nsys.exit(3)\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(CaregiverError, match="'leaves_at_once:x' cannot be loaded: SystemExit: 3"):
        find_caregiver("leaves_at_once:x")


def test_a_policy_of_actions_can_be_shown():
    episode = Episode.load("supervise", TINY, 0.5, caregiver=f"{HERE}:Still")
    assert episode.run_until(0.1)
    shown = episode.hud_state(1)
    assert (shown.target, shown.mark, shown.intervention) == (NOTHING, None, f"{HERE}:Still")
    assert shown.danger is None
    episode.policy = OwnPolicy("told", Telling, episode.env)
    assert episode.hud_state(1).intervention == "wait"
    assert shown.robot is not None


def test_the_policies_of_the_documentation(tmp_path, monkeypatch, capsys):
    page = (pathlib.Path(__file__).parents[2] / "docs" / "guide" / "policies.md").read_text()
    (code,) = re.findall(r"```python\n# my_policies.py\n(.*?)```", page, re.DOTALL)
    (tmp_path / "my_policies.py").write_text(code)
    (tmp_path / "weights.zip").touch()
    (tmp_path / "tiny.txt").write_text(TINY.text)
    monkeypatch.chdir(tmp_path)
    grid, house, *others = (line.split()[2:] for line in page.splitlines() if line.startswith("$ caregiver-mj "))
    assert cli.main([*grid, "--epsilon", "1", "--episodes", "3"]) == 0
    slow = ("none", "paper", "my_policies:NearestToMe")  # those in the grid's, too
    assert set(slow) < set(house)
    house = [word for word in house if word not in slow]
    assert cli.main([*house, "--house", "tiny.txt", "--epsilon", "1", "--episodes", "1", "--out", "runs/house"]) == 0
    assert [words[0] for words in others] == ["report", "render", "record"]
    out = capsys.readouterr().out
    assert all(f"my_policies:{name}" in out for name in ("NearestToMe", "roundabout"))
    code = json.loads((tmp_path / "runs" / "house" / "run.json").read_text())["code"]
    assert all(text.startswith("my_policies.py, sha256 ") for text in code.values())
    sys.modules.pop("my_policies")
