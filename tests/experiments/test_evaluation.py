"""Evaluation: what is in its rows, its table and its maps, and what they depend on."""

import dataclasses
import json
import pathlib
import re

import pandas as pd
import pyarrow.parquet as pq
import pytest
from comparing import rows, same
from walks import neighbours

from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.run_folder import RunFolder
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.sets import houses_named

# Columns of the contract, and their units, as the documentation has them.
PAGE = (pathlib.Path(__file__).parents[2] / "docs/reference/columns.md").read_text("utf-8").partition("\n## ")[0]
UNITS = dict(re.findall(r"^\| `(\w+)` \| (.*?) \|", PAGE, re.M))
MEASURES = [name for name in [*UNITS][9:] if not name.endswith("_by_child")]
PAPER = FloorPlan.load("paper")
SMALL = FloorPlan.parse("########\n#B..S..#\n#......#\n#.C..T.#\n#...B..#\n########", "small")
# World: house, caregiver, episodes, and families as they may be said; two of them have the same mean epsilon.
WORLDS = {
    "grid": (PAPER, "paper", 6, (1.0, 0.625, "1,.25")),
    "house": (SMALL, "guard", 2, ("1,.25",)),  # where an episode takes seconds
}


@pytest.fixture(params=["grid", pytest.param("house", marks=pytest.mark.slow)], scope="module")
def settings(request):
    plan, caregiver, episodes, families = WORLDS[request.param]
    return Settings(plan, request.param, ("none", caregiver), families, episodes, seed=3)


@pytest.fixture(scope="module")
def result(settings):
    return evaluate(settings)


def test_contract(settings, result, tmp_path):
    RunFolder(tmp_path, settings.record()).finish(result.episodes, result.summary, result.maps, result.houses)
    episodes = pd.read_parquet(tmp_path / "episodes.parquet")
    assert list(episodes.columns) == [*UNITS]
    combinations = [(str(family), caregiver) for family in settings.families for caregiver in settings.caregivers]
    assert len(episodes) == len(combinations) * settings.episodes
    assert not episodes.isna().any(axis=None)
    parts = episodes[["damage_stairwell", "damage_candle", "damage_table"]].sum(axis=1)
    assert (episodes.damage == parts).all()
    assert (episodes.damage == episodes.damage_by_child.map(sum)).all()
    assert (episodes.toys_reached == episodes.toys_by_child.map(sum)).all()
    assert (episodes.children == episodes.damage_by_child.map(len)).all()
    assert (episodes.children == episodes.family.map(lambda name: len(name.split(",")))).all()
    epsilons = {str(family): family.epsilon for family in settings.families}
    assert dict(zip(episodes.family, episodes.epsilon, strict=True)) == epsilons
    schema = pq.read_schema(tmp_path / "episodes.parquet")
    types = {(unit, str(schema.field(name).type)) for name, unit in UNITS.items() if name in MEASURES}
    units = {unit for unit, kind in types if kind == "int64"}
    assert units == {"", "timesteps", "cells", "bins", "moves"}
    assert types == {(unit, "int64" if unit in units else "double") for unit, _ in types}
    assert {str(schema.field(name).type.value_type) for name in ("damage_by_child", "toys_by_child")} == {"double"}
    assert episodes.timesteps_to_threshold.between(1, 200).all()
    assert (episodes.interventions_done <= episodes.interventions).all()
    alone = episodes[episodes.caregiver == "none"]
    nothing = ["moves_blocked", "moves_entered", "moves_held_up", "interventions", "interventions_done", "strikes"]
    assert (alone[nothing] == 0).all(axis=None)
    # 200 timesteps of 0.75 m at 1.6 km/h are 337.5 s
    assert episodes.sim_seconds.to_numpy() == pytest.approx(337.5, abs=2.0)

    summary = json.loads((tmp_path / "summary.json").read_text(), parse_constant=pytest.fail)
    assert [(r["family"], r["caregiver"]) for r in summary["rows"]] == combinations
    for row in summary["rows"]:
        assert row["world"] == settings.world
        assert row["house"] == settings.plans[0].name
        assert row["episodes"] == settings.episodes
        for column in ["damage_normalised", *MEASURES]:
            low, high = row[f"{column}_ci_low"], row[f"{column}_ci_high"]
            assert low - 1e-9 <= row[f"{column}_mean"]
            assert high is None or row[f"{column}_mean"] <= high + 1e-9
            assert row[f"{column}_sd"] >= 0
    assert summary["seed"] == 3
    wanted = {"caregiver_mj", "python", "numpy", "mujoco", "dm_control", "mink", "ruckig"}
    assert set(summary["versions"]) == wanted
    rows_alone, rows_guarded = (summary["rows"][i::2] for i in (0, 1))
    for row, alone, guarded in zip(summary["comparisons"], rows_alone, rows_guarded, strict=True):
        assert (row["caregiver"], row["baseline"], row["family"]) == (*settings.caregivers[::-1], alone["family"])
        assert row["epsilon"] == alone["epsilon"]
        assert row["damage_left"] == pytest.approx(guarded["damage_mean"] / alone["damage_mean"])


def test_maps_agree_with_the_rows(settings, result):
    maps = result.maps
    keys = ["world", "house", "caregiver", "family", "epsilon", "row", "column"]
    assert list(maps.columns) == [*keys, "visits", "damage"]
    (plan,) = settings.plans
    harmless = [all(plan[n] in ".#B" for n in neighbours(cell)) for cell in plan.free_cells]
    damage = result.episodes.groupby(["caregiver", "family"]).damage.sum()
    children = {str(family): len(family) for family in settings.families}
    for key, cells in maps.groupby(["caregiver", "family"]):
        assert list(zip(cells.row, cells.column, strict=True)) == list(plan.free_cells)
        assert cells.visits.sum() == 200 * settings.episodes * children[key[1]]
        assert cells.damage.sum() == damage[key] > 0
        assert (cells.damage[harmless] == 0).all()


@pytest.mark.parametrize("settings", ["grid"], indirect=True)
def test_rows_do_not_depend_on_jobs(settings, result):
    """Four jobs, which two workers may end in any order."""
    assert len(settings.blocks()) == 4
    same(evaluate(settings, jobs=2), result)


def test_rows_do_not_depend_on_company(settings, result):
    """Nor, in the house, on the process and what else that has run."""
    everything = rows(result)
    family = settings.families[-1]
    few = settings.episodes // 2
    alone = dataclasses.replace(settings, families=(family,), episodes=few)
    if settings.world == "grid":
        alone = dataclasses.replace(alone, caregivers=("paper",))
    wanted = everything[everything.caregiver.isin(alone.caregivers) & (everything.family == str(family))]
    wanted = wanted[wanted.episode < few].reset_index(drop=True)
    found = evaluate(alone, jobs=1 if settings.world == "grid" else 2)
    pd.testing.assert_frame_equal(rows(found), wanted, check_exact=True)


# That every caregiver decides for each episode alone is tried in the grid's tests.
@pytest.mark.parametrize(("caregiver", "family"), [("random", "1,.25"), ("paper", "1"), ("foresight", "1")])
def test_rows_do_not_depend_on_blocks(caregiver, family):
    settings = Settings(SMALL, "grid", (caregiver,), (family,), 3)
    assert [len(block) for block in settings.blocks(2)] == [2, 1]
    found = evaluate(settings)
    same(evaluate(settings, grid_block=2), found)
    assert found.episodes.damage.nunique() > 1


@pytest.mark.parametrize("world", ["grid", pytest.param("house", marks=pytest.mark.slow)])
def test_rows_of_a_house_do_not_depend_on_the_other_houses(world, tmp_path):
    plans, families = houses_named(["test-2"]), (1.0, "toddler:.5") if world == "grid" else (1.0,)
    settings = Settings((SMALL, *plans), world, ("none",), families, 2 if world == "grid" else 1, seed=4)
    found = evaluate(settings, RunFolder(tmp_path / "run", settings.record()), jobs=2)
    assert list(dict.fromkeys(found.episodes.house)) == ["small", "house-200000", "house-200001"]
    by_itself = evaluate(dataclasses.replace(settings, plans=plans[1]))
    for table, alone in ((found.episodes, by_itself.episodes), (found.maps, by_itself.maps)):
        here = table[table.house == "house-200001"].reset_index(drop=True).drop(columns="wall_seconds", errors="ignore")
        pd.testing.assert_frame_equal(here, alone.drop(columns="wall_seconds", errors="ignore"), check_exact=True)
    again = RunFolder(tmp_path / "run", settings.record(), resume=True)
    assert all(again.read(str(block)) is not None for block in settings.blocks())


def test_rows_do_not_depend_on_the_children_beside_them():
    families = (1.0, "explorer:.25", "toddler:.5", "avoider:.1", "seeker:.5", "1,.25", "adversary:0,explorer:.5")
    families += ("switcher:.25", "drifter:.4", "waverer:.4")
    settings = Settings(SMALL, "grid", ("paper",), families, 3)
    assert [len(block.families) for block in settings.blocks()] == [8, 2]
    each = [rows(evaluate(dataclasses.replace(settings, families=(family,)))) for family in families]
    pd.testing.assert_frame_equal(rows(evaluate(settings)), pd.concat(each, ignore_index=True), check_exact=True)
