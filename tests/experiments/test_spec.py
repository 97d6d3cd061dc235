"""The specification of an episode: written and read as JSON, hashed whole, and what is refused."""

import dataclasses
import json
from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from caregiver_mj import CaregiverError, FloorPlan
from caregiver_mj.caregivers.server import Queries
from caregiver_mj.children.novice import Novice
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.spec import EpisodeSpec, episode_seed
from caregiver_mj.house.sensing import Blur, Sensing
from caregiver_mj.plans.hazards import DamageWeights

TEXT = "########\n#B..S..#\n#......#\n#.C..T.#\n#...B..#\n########"
PLAN = FloorPlan.parse(TEXT, "tiny")
ASKS = EpisodeSpec(PLAN, 0.5, "http://127.0.0.1:9")
share = st.floats(0.0, 1.0)
number = st.none() | st.integers(-9, 9) | st.floats(allow_nan=False, allow_infinity=False) | st.booleans() | st.text()
queries = st.builds(
    Queries,
    max_calls=st.none() | st.integers(0, 2**40),
    patience=st.floats(0.0, 86_400.0),
    thinking=st.sampled_from(["waits", "real-time"]),
    frames=st.booleans(),
)
runs = st.builds(
    Settings,
    st.builds(
        FloorPlan.parse,
        st.just(TEXT),
        st.sampled_from(["tiny", "ä/b"]),
        st.floats(0.5, 1.1),
        st.builds(DamageWeights, st.floats(0.0, 1e3), share, share, mug=share),
    ),
    st.sampled_from(["house", "grid"]),
    st.lists(st.sampled_from(["none", "floor", "http://127.0.0.1:9", "chat:m", "a.b:c"]), min_size=1, unique=True),
    st.lists(share, min_size=1, unique_by=str),
    st.integers(1, 1000),
    st.integers(0, 2**80),
    embodiment=st.sampled_from(["mobile_fr3", "mobile_ur5e"]),
    sight=st.sampled_from(["all", "walls", "rooms:3"]),
    child_speed=st.floats(0.1, 1.0),
    houses=st.sampled_from(["", "those two"]),
    task=st.sampled_from(["supervise", "block_stairs", "targets"]),
    task_kwargs=st.dictionaries(st.text(), number | st.lists(number) | st.dictionaries(st.text(), number)),
    queries=queries,
)


@settings(deadline=None, max_examples=40)
@given(runs)
def test_episodes_are_read_as_they_were_written(run):
    with mock.patch.object(Settings, "code", dict):  # of which there is none
        again = Settings.of_record(json.loads(json.dumps(run.record(), allow_nan=False)))
    assert again == run
    spec, read = (one.specs(one.blocks()[-1])[-1] for one in (run, again))
    assert (hash(read), read.digest()) == (hash(spec), spec.digest())


OTHER = {
    "plan": [
        FloorPlan.parse(TEXT, "other"),
        FloorPlan.parse(TEXT, "tiny", 0.8),
        FloorPlan.parse(TEXT.replace("#...B", "#..TB"), "tiny"),
        FloorPlan.parse(TEXT, "tiny", damage=DamageWeights(mug=9.0)),
    ],
    "family": ["0.25", "0.5,0.5", "toddler:0.5"],
    "caregiver": ["foresight", "https://127.0.0.1:9"],
    "episode": [1, None],
    "world": ["grid"],
    "seed": [1],
    "embodiment": ["mobile_ur5e"],
    "sight": ["walls", "rooms:1"],
    "child_speed": [0.25, 0.8],
    "task": ["block_stairs"],
    "task_kwargs": [
        {"control_timestep": 0.04},
        {"table_offset": 0.1},
        {"candle_offset": 0.0},
        {"time_limit": 60.0},
        {"sensing": {"child": {"noise": 0.01}}},
    ],
    "queries": [
        Queries(max_calls=3),
        Queries(max_tokens=3),
        Queries(patience=3.0),
        Queries(thinking="real-time"),
        Queries(frames=True),
    ],
}


def test_any_field_that_changes_changes_its_hash():
    assert {*OTHER, "file"} == {field.name for field in dataclasses.fields(EpisodeSpec)}
    others = [dataclasses.replace(ASKS, **{name: value}) for name, values in OTHER.items() for value in values]
    models = [dataclasses.replace(ASKS, caregiver="chat:m", queries=Queries(f"http://{host}/v1")) for host in "ab"]
    digests = [spec.digest() for spec in (ASKS, *others, *models)]
    assert len(set(digests)) == len(digests)


def test_what_changes_no_row_does_not_change_it():
    same = dataclasses.replace(ASKS, file="mine.txt", queries=Queries(folder="run/exchanges"))
    assert same.digest() == ASKS.digest()
    assert dataclasses.replace(ASKS, caregiver="nearest", queries=Queries(max_calls=3)).queries == Queries()


def test_the_speed_of_children_is_in_a_record_only_where_it_is_not_the_papers():
    usual, faster = (EpisodeSpec(PLAN, 0.5, "none", child_speed=speed) for speed in (1.6 / 3.6, 0.8))
    assert usual.record() == EpisodeSpec(PLAN, 0.5, "none").record()
    assert "child_speed" not in usual.record()
    assert faster.record()["child_speed"] == 0.8
    settings = Settings.around(faster, ("none",), 1)
    assert Settings.of_record(settings.record()).spec(PLAN, faster.family, "none") == faster
    for wrong in (0.0, 3.0, "fast", float("nan")):
        with pytest.raises(CaregiverError, match="child_speed, in m/s, must be in"):
            EpisodeSpec(PLAN, 0.5, "none", child_speed=wrong)


def test_fields_are_taken_as_people_write_them():
    sensing = Sensing(child=Blur(noise=0.01))
    options = {"sensing": sensing, "table_offset": np.float64(0.1), "compliant_children": np.True_}
    spec = EpisodeSpec("paper", [1.0, 0.25], seed=np.int64(4), task_kwargs=options)
    assert (spec.plan, str(spec.family), spec.seed) == (FloorPlan.load("paper"), "1,0.25", 4)
    assert Sensing.of(spec.options["sensing"]) == sensing
    assert (spec.options["table_offset"], spec.options["compliant_children"]) == (0.1, True)
    assert spec.options["compliant_children"] is True
    assert EpisodeSpec(PLAN, seed=4, episode=2).own_seed == episode_seed(4, 2)
    assert EpisodeSpec(PLAN, seed=4, episode=None).own_seed == 4


def test_what_cannot_be_written_is_refused():
    with pytest.raises(CaregiverError, match="task_kwargs must be numbers, texts"):
        EpisodeSpec(PLAN, task_kwargs={"sensing": object()})
    with pytest.raises(CaregiverError, match="children of a specification must be given by name"):
        EpisodeSpec(PLAN, Novice(PLAN, 0.5)).record()
    nested: list = []
    for _ in range(200_000):
        nested = [nested]
    with pytest.raises(CaregiverError, match="task_kwargs must be"):
        EpisodeSpec(PLAN, task_kwargs={"a": nested})
    with pytest.raises(CaregiverError, match="queries"):
        EpisodeSpec(PLAN, queries={})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"caregivers": 3}, "caregivers must be a list, got 3"),
        ({"sight": []}, "sight must be a str"),
        ({"plans": ["paper"]}, "a house must be a dict"),
        ({"queries": {"key": "x"}}, "queries must be base_url, .*, got 'key'"),
        ({"queries": {"patience": "x"}}, "patience, in seconds,"),
        ({"world": "zzz"}, "no world 'zzz'"),
    ],
)
def test_a_record_of_something_else_is_refused(change, words):
    with pytest.raises(CaregiverError, match=words):
        Settings.of_record(Settings(PLAN, caregivers=("none",)).record() | change)


def test_options_of_a_stranger_name_no_code_and_change_no_task():
    record = Settings(PLAN, caregivers=("none",), episodes=1).record()
    for name in ("embodiment", "family", "robot", "random", "sight"):
        with pytest.raises(CaregiverError, match=f"task_kwargs must be without {name}"):
            Settings.of_record(record | {"task_kwargs": {name: "os:abort"}})
    for change in ({"task_kwargs": {"control_timestep": 1e-9}}, {"task": "block_stairs"}):
        with pytest.raises(CaregiverError, match="its task must be supervise without task_kwargs: --trust"):
            Settings.of_record(record | change).check_installed()
    Settings.of_record(record).check_installed()


def test_settings_are_a_set_of_them():
    run = Settings(PLAN, "grid", ("none", "nearest"), (1.0, "0.5"), 3, 7, sight="walls")
    found = [spec for block in run.blocks() for spec in run.specs(block)]
    assert len({spec.digest() for spec in found}) == len(found) == 2 * 2 * 3
    assert EpisodeSpec(PLAN, 0.5, "nearest", 2, "grid", 7, sight="walls") in found
    assert dataclasses.replace(run, families=("0.5",)) == Settings.around(found[-1], run.caregivers, 3)


def test_the_address_of_models_is_that_of_where_it_was_made(monkeypatch):
    """A worker, or a reader, with another environment asks and hashes the same."""
    monkeypatch.setenv("OPENAI_BASE_URL", "http://127.0.0.1:1/v1")
    run = Settings(PLAN, caregivers=("chat:m",))
    spec = run.spec(PLAN, run.families[0], "chat:m")
    monkeypatch.setenv("OPENAI_BASE_URL", "http://127.0.0.1:2/v1")
    assert run.spec(PLAN, run.families[0], "chat:m") == spec
    monkeypatch.delenv("OPENAI_BASE_URL")
    usual = EpisodeSpec(PLAN, 0.5, "chat:m")
    monkeypatch.setenv("OPENAI_BASE_URL", "http://127.0.0.1:2/v1")
    assert dataclasses.replace(usual, episode=1).queries.base_url == usual.queries.base_url != ""


def test_an_address_with_a_secret_is_in_no_record(monkeypatch):
    monkeypatch.setenv("OPENAI_BASE_URL", "http://user:secretpw@127.0.0.1:1/v1")
    for replayed in (False, True):
        with pytest.raises(CaregiverError, match="without user, password") as error:
            EpisodeSpec(PLAN, 0.5, "chat:m").check(replayed)
        assert "secretpw" not in str(error.value)
    with pytest.raises(CaregiverError, match="without user, password"):
        EpisodeSpec(PLAN, 0.5, "chat:m").record()
    with pytest.raises(CaregiverError, match="without user, password"):
        Settings(PLAN, caregivers=("chat:m",)).record()
