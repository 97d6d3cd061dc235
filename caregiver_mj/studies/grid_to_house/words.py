"""The page's sentences with figures in them."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.recording.ledger import KINDS
from caregiver_mj.studies.documents import fill
from caregiver_mj.studies.grid_to_house.phases import DONE, FAILED, GIVEN_UP, PARTS, PHASES
from caregiver_mj.studies.grid_to_house.results import EPSILONS, GOAL, Results

_LONG = 20.0  # seconds; no way in the house takes that long by itself
# What an episode's seconds go into, in words.
_BUDGET = {
    "block": "on the way to stairwells",
    "guard": "standing in them",
    "fetch": "fetching",
    "carry": "carrying",
    "unfinished": "in phases not completed",
    "idle": "out of the way with nothing to do",
}


def where(low: float, high: float) -> str:
    """Where the interval of house over grid lies."""
    if math.isinf(high):
        return "of so few episodes has no upper end"
    if high <= 1 + GOAL:
        return "lies within the goal as a whole"
    return "lies above the goal as a whole" if low > 1 + GOAL else "reaches to both sides of the goal"


def differences(results: Results) -> str:
    """Which kinds of damage make the difference."""
    kinds = {kind: sum(results.house[e][f"damage_{kind}"].mean() - results.grid[e][f"damage_{kind}"].mean()
                       for e in EPSILONS) / len(EPSILONS) for kind in KINDS}  # fmt: skip
    parts = ", ".join(f"{value:+.2f} by {kind}s" for kind, value in kinds.items())
    return f"The mean difference of {sum(kinds.values()):+.2f} damage an episode comes from {parts}."


def delay(results: Results) -> str:
    """How much slower the house is over all phases."""
    done = results.done
    return (
        f"A completed phase takes {(done.house - done.grid).mean():.2f} s more than the shortest way does in the grid "
        f"(median {(done.house - done.grid).median():.2f} s): {(done.clear + done.hand - done.grid).mean():.2f} s for "
        f"what the robot is, and {(done.house - done.hand - done.clear).mean():.2f} s for the child in its way, of "
        f"which the grid's caregiver loses {done.phase.map(results.grid_delays).mean():.2f} s as well."
    )


def same_alone(results: Results) -> str:
    """In how many episodes the child alone takes the same damage in both worlds."""
    same = sum((grid == house).sum() for grid, house in results.alone.values())
    return f"{same} of {results.episodes * len(EPSILONS)} episodes have the same damage in both worlds"


def explanation(results: Results) -> str:
    """What the extra time is made of, phase by phase."""
    lines = []
    for phase in PHASES:
        own = results.done[results.done.phase == phase]
        if not len(own):
            continue
        detour = (own.full + own.slowed - own.lost - own.clear).mean()
        lines.append(
            f"- **{phase}**: {(own.house - own.grid).mean():+.2f} s. The robot itself costs "
            f"{(own.clear + own.hand - own.grid).mean():+.2f} s: drive in an empty house and hand, less the grid's "
            f"time. The child costs {(own.house - own.hand - own.clear).mean():.2f} s: {detour:+.2f} s for longer "
            f"ways (and ways begun anew), {own.lost.mean():.2f} s lost while slowed, {own.stopped.mean():.2f} s "
            f"stopped and {own.aside.mean():.2f} s aside. In the grid, where the caregiver goes round the novice and "
            f"steps aside as well, that is {results.grid_delays[phase]:.2f} s. The slowest tenth of the phases take "
            f"{slowest(own):.0%} of all the time by which any are slower than the grid's."
        )
    return "\n".join(fill(line, "  ") for line in lines)


def slowest(phases: pd.DataFrame) -> float:
    """The share of all extra time, where there is any, that the worst tenth of some phases take."""
    over = np.sort((phases.house - phases.grid).clip(lower=0.0))[::-1]
    return float(over[: math.ceil(len(over) / 10)].sum() / over.sum()) if over.sum() > 0 else 0.0


def endings(results: Results) -> str:
    """How phases ended."""
    counts = results.phases.groupby(["phase", "end"]).size()
    told = [
        f"{phase}: {counts.get((phase, DONE), 0)} done, {counts.get((phase, GIVEN_UP), 0)} given up for another "
        f"target or at the end, {counts.get((phase, FAILED), 0)} failed"
        for phase in PHASES
    ]
    return fill(f"Phases begun: {'; '.join(told)}.")


def budget(results: Results) -> str:
    """What an episode's time goes into."""
    seconds, episodes = results.seconds.mean(), len(results.seconds)
    told = ", ".join(f"{seconds.get(key, 0.0):.1f} s {words}" for key, words in _BUDGET.items())
    unfinished = results.phases[results.phases.end != DONE][list(PARTS)].sum() / episodes
    parts = ", ".join(f"{unfinished[part]:.1f} s {title}" for part, title in PARTS.items())
    long = results.phases[results.phases.house > _LONG]
    whole, aside, stopped = long[["house", "aside", "stopped"]].sum() / episodes
    return fill(
        f"An episode's {seconds.sum():.1f} s ({EPISODE_TIMESTEPS} novice timesteps) are: {told}. Of those in phases "
        f"not completed are {parts}. {len(long)} of {len(results.phases)} phases took more than {_LONG:g} s; together "
        f"they are {whole:.1f} s an episode, of which {aside:.1f} s stepping aside and {stopped:.1f} s stopped; "
        f"{(long.end != DONE).sum()} of them were given up."
    )
