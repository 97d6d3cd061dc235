"""The page's sentences with figures in them."""

from __future__ import annotations

import math

from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.recording.ledger import KINDS
from caregiver_mj.robot.separation import FORESIGHT
from caregiver_mj.studies.grid_to_house.breakdown import ALONE, GRID, REMAINDER, STEPS
from caregiver_mj.studies.grid_to_house.phases import DONE, FAILED, GIVEN_UP, PARTS, PHASES
from caregiver_mj.studies.grid_to_house.ratios import alone, ratio, steps
from caregiver_mj.studies.grid_to_house.results import GOAL, Results
from caregiver_mj.studies.grid_to_house.tables import number, signed

# What an episode's seconds go into, in words.
_BUDGET = {
    "block": "on the way to stairwells",
    "guard": "standing in them",
    "fetch": "fetching",
    "carry": "carrying",
    "unfinished": "in phases not completed",
    "idle": "out of the way with nothing to do",
}


def headline(results: Results) -> str:
    """The ratio over houses, and whether it is small enough."""
    found = ratio(*results.rows.cared)
    verdict = "within" if found.value <= 1 + GOAL else "not within"
    return (
        f"With the caregiver, the physical house leaves {number(found.value)} times the damage that the grid leaves "
        f"(95 % interval {number(found.low)} to {number(found.high)}, with the house as the unit of chance). That is "
        f"{verdict} the goal of {1 + GOAL:.2f} at most; the interval {where(found)}. {differences(results)}"
    )


def where(found: Estimate[float]) -> str:
    """Where the interval of house over grid lies."""
    if not (math.isfinite(found.low) and math.isfinite(found.high)):
        return "has no end, for there is too little to tell from"
    if found.high <= 1 + GOAL:
        return "lies within the goal as a whole"
    return "lies above the goal as a whole" if found.low > 1 + GOAL else "reaches to both sides of the goal"


def differences(results: Results) -> str:
    """Which kinds of damage make the difference."""
    cared = results.rows.table[results.rows.table.caregiver == results.rows.caregiver]
    means = cared.groupby("world")[[f"damage_{kind}" for kind in KINDS]].mean()
    parts = dict(zip(KINDS, means.loc["house"] - means.loc["grid"], strict=True))
    told = ", ".join(f"{number(value, '+')} by {kind}s" for kind, value in parts.items())
    return f"The mean difference of {number(sum(parts.values()), '+')} damage an episode comes from {told}."


def blame(results: Results) -> str:
    """What the difference is made of, and what the greatest part of it is."""
    found = {name: whole for name, (_, whole) in steps(results).items()}
    total = sum(step.value for step in found.values())
    told = ", ".join(f"{STEPS.get(name, name)} {signed(step)}" for name, step in found.items())
    greatest = max(STEPS, key=lambda name: found[name].value)
    if found[greatest].value <= 0:
        verdict = "None of the three makes the house worse."
    elif found[greatest].low > 0:
        verdict = f"The greatest of the three is {STEPS[greatest]}."
    else:
        verdict = f"The greatest of the three is {STEPS[greatest]}, but that may be chance as well."
    return (
        f"From the grid's 1 to the house's {number(1 + total)} it is {number(total, '+')}: {told}. {verdict} "
        f"{left_over(found[REMAINDER])}"
    )


def left_over(step: Estimate[float]) -> str:
    """Whether the handicaps explain the house."""
    if step.low > 0:
        return "Together they do not explain the house: it leaves more."
    return "Together they overdo it: the house leaves less." if step.high < 0 else (
        "What they leave unexplained may be chance."
    )  # fmt: skip


def handicaps(results: Results) -> str:
    """What the grid's caregiver is made to lack."""
    last = results.handicaps["waiting"]
    without = " and ".join(f"{name} {signed(alone(results, level))}" for level, name in ALONE.items())
    return (
        f"*Driving*: each of its actions takes {last.pace:.2f} thirds of a timestep instead of one, as what it does "
        f"takes the robot with no child in the house. *Waiting*: each that begins within {FORESIGHT:g} m of the child, "
        f"where the robot minds it, takes {last.near:.2f} thirds more; so much that the child costs it as much time as "
        f"the robot. Without the others, {without}."
    )


def delay(results: Results) -> str:
    """How much slower the house is over all phases."""
    done = results.done
    return (
        f"A completed phase takes {(done.house - done.grid).mean():.2f} s more than the shortest way does in the grid "
        f"(median {(done.house - done.grid).median():.2f} s): {(done.clear + done.hand - done.grid).mean():.2f} s for "
        f"what the robot is, and {(done.house - done.hand - done.clear).mean():.2f} s for the child in its way. The "
        f"grid's caregiver, which goes round the child and steps aside as well, takes {results.delays[GRID]:.2f} s "
        f"more than on the shortest way; with all handicaps {results.delays['waiting']:.2f} s."
    )


def checks(results: Results) -> str:
    """What must be equal, and whether it is."""
    grid, house = (results.rows.damage(world, "none") for world in ("grid", "house"))
    same = int((grid == house).to_numpy().sum())
    return (
        f"Alone, {same} of {grid.size} episodes have the same damage in both worlds. Watched again, {results.same[0]} "
        f"of {results.same[1]} episodes have the damage that they have in the run."
    )


def endings(results: Results) -> str:
    """How phases ended."""
    counts = results.phases.groupby(["phase", "end"]).size()
    told = [
        f"{phase}: {counts.get((phase, DONE), 0)} done, {counts.get((phase, GIVEN_UP), 0)} given up for another "
        f"target or at the end, {counts.get((phase, FAILED), 0)} failed"
        for phase in PHASES
    ]
    return f"Phases begun: {'; '.join(told)}."


def budget(results: Results) -> str:
    """What an episode's time goes into."""
    seconds, episodes = results.seconds.mean(), len(results.seconds)
    told = ", ".join(f"{seconds.get(key, 0.0):.1f} s {words}" for key, words in _BUDGET.items())
    unfinished = results.phases[results.phases.end != DONE][list(PARTS)].sum() / episodes
    parts = ", ".join(f"{unfinished[part]:.1f} s {title}" for part, title in PARTS.items())
    return (
        f"An episode's {seconds.sum():.1f} s ({EPISODE_TIMESTEPS} novice timesteps) are: {told}. Of those in phases "
        f"not completed are {parts}."
    )


def aside(results: Results) -> str:
    """What the line below the average is, if there is one."""
    if not results.aside:
        return ""
    rows = results.aside
    return (
        f" As an aside, and not in the average, house `{rows.settings.place}` over {rows.episodes} episodes, with "
        "an interval over these."
    )
