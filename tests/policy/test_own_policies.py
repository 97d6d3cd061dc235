"""Policies of one's own, of targets and of the robot's actions: where they may stand, and what they must answer."""

import importlib.metadata

import gymnasium
import numpy as np
import pytest

import caregiver_mj
from caregiver_mj import CaregiverError, CaregiverPolicy, FloorPlan
from caregiver_mj.caregivers import TargetPolicy, make_caregiver
from caregiver_mj.caregivers.registry import find_caregiver
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.spec import episode_seed
from caregiver_mj.policy.own import OwnPolicy, make_policy

gymnasium.register_envs(caregiver_mj)
TINY = FloorPlan.parse("######\n#B.S.#\n#....#\n#C..T#\n######", "tiny")
HERE = __name__
seen = []  # what policies of this file were shown


class Last(TargetPolicy):
    """Protects the children from the last that it can do something about."""

    def act(self, observations, masks):
        seen.append((observations, masks))
        return masks.shape[1] - 1 - masks[:, ::-1].argmax(axis=1)


class Map(Last):
    slots = (3, 2)
    observation = "map"
    shape = (7, 7)


class Still:
    def __init__(self, env):
        self.action = np.zeros(env.action_spec().shape)
        self.seeds = []

    def reset(self, seed):
        self.seeds.append(seed)

    def __call__(self, timestep):
        return self.action


def too_short(env):
    return lambda timestep: np.zeros(3)


def no_maker(env):
    return np.zeros(env.action_spec().shape)


class Beyond(TargetPolicy):
    """Answers with the number after the last."""

    def act(self, observations, masks):
        return np.full(len(masks), masks.shape[1])


class Unfinished(TargetPolicy):
    """Has no `act`."""


class Orphan:
    """One that forgot what it is."""

    def choose(self, percept):
        return np.full(len(percept.caregiver_cell), -1)


class OrphanThatDecides:
    """Another one."""

    def decide(self, percept):
        return None


NUMBER = 3


@pytest.mark.parametrize(("world", "policy"), [("grid", Last), pytest.param("house", Map, marks=pytest.mark.slow)])
def test_a_policy_of_targets_meets_what_it_was_trained_in(world, policy):
    seen.clear()
    settings = Settings(TINY, world, (f"{HERE}:{policy.__name__}",), (1.0,), 1)
    row = evaluate(settings).episodes.iloc[0]
    shown = list(seen)
    options = {name: getattr(policy, name) for name in ("observation", "slots", "shape")}
    env = gymnasium.make("caregiver_mj/Supervise-Targets-v0", world=world, house=TINY, epsilon=1.0, **options)
    observation, info = env.reset(seed=episode_seed(0, 0))
    ended = False
    for observations, masks in shown:
        assert not ended
        for key in observation:
            np.testing.assert_array_equal(observations[key][0], observation[key])
        np.testing.assert_array_equal(masks[0], info["action_mask"])
        action = policy.act(None, observations, masks)[0]
        observation, _, _, ended, info = env.step(action)
    assert ended
    scalars = {key: value for key, value in info["outcome"].items() if np.isscalar(value)}
    assert scalars == row[[*scalars]].to_dict()
    assert row["interventions"] > 0


def test_a_policy_of_actions_is_made_for_its_environment_and_told_the_seed():
    env = caregiver_mj.load("supervise", TINY, 0.5, random=0, task_kwargs={"time_limit": 1.0}, visuals=False)
    made = []
    policy = OwnPolicy("still", lambda env: made.append(Still(env)) or made[0], env)
    for _ in range(2):
        timestep = env.reset()
        while not timestep.last():
            action = policy(timestep)
            timestep = env.step(action)
            action += 1.0
    assert not made[0].action.any()  # which is its own
    assert (len(made), len(set(made[0].seeds))) == (1, 2)
    assert isinstance(make_policy(env, f"{HERE}:Still"), OwnPolicy)
    assert isinstance(make_policy(env, f"{HERE}:Last"), CaregiverPolicy)
    assert isinstance(make_policy(env, "nearest"), CaregiverPolicy)


def test_a_mistake_in_a_policy_is_told_with_its_place():
    env = caregiver_mj.load("supervise", TINY, 0.5, random=0, visuals=False)
    policy = OwnPolicy("mine", lambda env: lambda timestep: {}["nothing"], env)
    with pytest.raises(
        CaregiverError, match=r"'mine' failed .*: KeyError: 'nothing' \(.*test_own_policies.py, line \d"
    ):
        policy(env.reset())


@pytest.mark.parametrize(
    ("world", "name", "words"),
    [
        ("grid", f"{HERE}:Still", "world must be house for 'test_own_policies:Still', a policy of the robot's actions"),
        ("house", f"{HERE}:no_maker", "must make a policy of an environment, .* got ndarray"),
        ("house", f"{HERE}:too_short", "too_short' must answer with 11 finite numbers, got array"),
        ("grid", f"{HERE}:Beyond", r"Beyond.act must answer with .*\b0 to 2, got"),  # nothing, stairwell, candle
        ("grid", f"{HERE}:Unfinished", "'test_own_policies:Unfinished' must have act, got none"),
        ("grid", f"{HERE}:NUMBER", "must be a subclass of Caregiver or a function that makes a policy"),
        ("grid", f"{HERE}:Orphan", "must be a subclass of Caregiver or a function that .* got <class '.*Orphan'>"),
        ("house", f"{HERE}:OrphanThatDecides", "must be a subclass of Caregiver or a function that .* got <class"),
        ("grid", f"{HERE}:Nobody", "cannot be loaded: AttributeError: .* no attribute 'Nobody'"),
        ("grid", "nobody_at_home:x", "cannot be loaded: ModuleNotFoundError: No module named 'nobody_at_home'"),
    ],
)
def test_what_is_none_is_named(world, name, words):
    with pytest.raises(CaregiverError, match=words):
        evaluate(Settings(TINY, world, (name,), (1.0,), 1))


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
        CaregiverError, match=r"'number' \(test_own_policies:NUMBER\) must be a subclass of Caregiver or"
    ):
        find_caregiver("number")
    with pytest.raises(CaregiverError, match="must be a subclass of Caregiver, got 'still', a policy"):
        make_caregiver("still", TINY)
    with pytest.raises(CaregiverError, match=r"no caregiver 'nobody': there are none, .*, mine, number, still, and"):
        find_caregiver("nobody")
