"""Sets of houses, to learn in and to be tested in, and houses of every shape."""

import hashlib

import pytest

from caregiver_mj import cli
from caregiver_mj.errors import FloorPlanError
from caregiver_mj.plans.floor_plan import FloorPlan, house_names
from caregiver_mj.plans.generator import is_drivable
from caregiver_mj.plans.sets import house_set, houses_named


def test_a_set_is_a_beginning_of_every_larger_one_and_none_shares_a_house():
    small, large = house_set("test-3"), house_set("test-8")
    assert len(large) == 8
    assert small == large[:3]
    train, test = house_set("train-40"), house_set("test-40")
    assert len({plan.rows for plan in (*train, *test)}) == 80
    # The seeds of the largest sets that there are do not meet either.
    assert FloorPlan.load("train-1000/999").name == "house-100999"
    assert FloorPlan.load("test-1000/0").name == "house-200000"
    with pytest.raises(FloorPlanError, match=r"no floor plan 'test-5/5': .* are test-5/0 to test-5/4"):
        FloorPlan.load("test-5/5")


def test_houses_of_a_secret_are_others_for_every_secret_and_in_no_list():
    names = [[plan.name for plan in house_set(f"test-3@{secret}")] for secret in ("apple", "pear")]
    assert len({*names[0], *names[1]}) == 6
    assert [plan.name for plan in house_set("test-2@apple")] == names[0][:2]
    assert min(int(name.removeprefix("house-")) for name in names[0]) >= 1_000_000
    # By hand: 10^6 + the first 12 digits of SHA-256("test@apple 0") modulo 999,000,000.
    digits = hashlib.sha256(b"test@apple 0").hexdigest()[:12]
    assert names[0][0] == f"house-{1_000_000 + int(digits, 16) % 999_000_000}"


@pytest.mark.parametrize("name", ["train-5", "test-5", "home-train-2", "home-test-2", "shapes-test-2@a secret"])
def test_houses_of_a_set_are_loaded_by_name(name):
    for i, plan in enumerate(house_set(name)):
        assert FloorPlan.load(f"{name}/{i}") == plan == FloorPlan.load(plan.name)


def test_a_house_twice_is_refused():
    with pytest.raises(FloorPlanError, match=r"^houses must be different, got 'house-200001' twice$"):
        houses_named(["test-2", "test-100/1"])


def of_sets(*kinds):
    return [f"{kind}-1000/{i}" for kind in kinds for i in range(0, 1000, 83)]


@pytest.mark.parametrize(
    ("names", "digest"),
    [
        (
            [f"house-{seed}" for seed in range(12)]
            + of_sets("train", "test")
            + ["house-17-14x12-rooms3-stairwells1-candles2-tables3-bins2", "house-5-30x20", "house-3-rooms2"],
            "91b5208b693a4dfeb44efac9e18ffe0b976400bc4bced5bcef8d188e4d9c5adf",
        ),
        (of_sets("home-train", "home-test"), "7e11d0b8729daab9dbf30fd2bb93933324b5a64792f97d035720faab4bc45d64"),
    ],
    ids=["houses", "homes"],
)
def test_generated_houses_and_their_sets_stay_the_same_to_the_character(names, digest):
    # Results are published for these houses by their names.
    text = "\n\n".join(f"{plan.name}\n{plan.text}" for plan in map(FloorPlan.load, names))
    assert hashlib.sha256(text.encode()).hexdigest() == digest


def test_ten_houses_drawn_by_hand():
    """They are there to judge caregivers by: they were drawn before any was tried in them, and stay as they are."""
    plans = house_set("drawn-10")
    assert {plan.name for plan in plans} == {*house_names()} - {"paper", "apartment", "home"}
    assert all(map(is_drivable, plans))
    assert FloorPlan.load("drawn-10/3") == plans[3]
    text = "\n\n".join(f"{plan.name}\n{plan.text}" for plan in plans)
    digest = "21472c123635c6c979ad3e2811c2ec8f30d45e4f23a35c2bf4234ad260253b19"
    assert hashlib.sha256(text.encode()).hexdigest() == digest


SHAPES = (
    "hall", "alcoves", "dead-ends", "open-plan", "loops", "chain", "stairs-only", "many-tables", "far-bins",
)  # fmt: skip


def houses(shape):
    return [FloorPlan.load(f"{shape}-{seed}") for seed in range(700, 704)]


@pytest.mark.parametrize("shape", SHAPES)
def test_each_can_be_lived_and_worked_in(shape):
    for plan in houses(shape):
        assert 10 <= len(plan.free_cells) <= 100
        assert is_drivable(plan)
        assert (plan.graph.table_distances < 1000).all()
        assert (plan.graph.stairwell_distances < 1000).all()
        assert plan.bins
        assert FloorPlan.load(plan.name).rows == plan.rows
    assert len({plan.rows for plan in houses(shape)}) == 4


def test_sets_are_balanced_over_the_shapes():
    names = [plan.name for plan in house_set("shapes-test-20")]
    assert sorted(name.rpartition("-")[0] for name in names) == sorted(2 * ["house", *SHAPES])
    assert not set(names) & {plan.name for plan in house_set("shapes-train-20")}
    assert FloorPlan.load("shapes-test-20/3").rows == FloorPlan.load(names[3]).rows


def test_a_valid_house_that_the_robot_cannot_work_in_is_warned_of(tmp_path, capsys):
    (tmp_path / "narrow.txt").write_text("########\n#..#####\n#......#\n#B.#T#B#\n########\n")
    assert cli.main(["house", "check", str(tmp_path / "narrow.txt")]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("OK: narrow")
    assert "warning: the robot has no room" in err
    assert (cli.main(["house", "check", "hall-3"]), capsys.readouterr().err) == (0, "")
