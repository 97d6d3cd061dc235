"""The page docs/grid_to_house.md."""

from __future__ import annotations

from caregiver_mj.studies.documents import fill
from caregiver_mj.studies.grid_to_house import words
from caregiver_mj.studies.grid_to_house.phases import FULL_RATE, STOPPED_RATE
from caregiver_mj.studies.grid_to_house.results import GOAL, Results
from caregiver_mj.studies.grid_to_house.tables import damage_table, kind_table, phase_table


def document(results: Results, command: str) -> str:
    """The text of the page, which a command prints."""
    mean, low, high = results.ratio()
    verdict = "within" if mean <= 1 + GOAL else "not within"
    intro = fill(
        f"The caregiver `paper` on house `paper`, {results.episodes} episodes for each epsilon, the same novices in "
        "the grid and in the physical house. All of this page is printed by"
    )
    headline = fill(
        f"With the caregiver, the house leaves {mean:.2f} times the damage that the grid leaves, averaged over epsilon "
        f"1, 0.75 and 0.5 (95 % interval {low:.2f} to {high:.2f}). That is {verdict} the goal of "
        f"{1 + GOAL:.2f} at most; the interval {words.where(low, high)}. {words.differences(results)} "
        f"{words.delay(results)}"
    )
    parts = fill(
        "Completed phases, in seconds, mean (median). *Grid*: cells on the shortest way times a third of a novice "
        "timestep, and one action more to get or place. *Clear*: what the base would drive in an empty house, from "
        "rest. *House*: what it took, which is the sum of the five that follow: driving at full rate (round the child, "
        f"too), slowed for it (below {FULL_RATE:.0%} of the planned speed), stopped for it (below "
        f"{STOPPED_RATE:.0%}, or waiting for a way), stepping aside for it, and the hand, from when the base has "
        "arrived until the phase is over."
    )
    columns = fill(
        "Mean damage an episode alone and with the caregiver, what is left of it, and *house / grid*, the ratio of "
        f"damage with the caregiver. In brackets: 95 % intervals over the same {results.episodes} episodes. "
        f"*Of many* is what is left in the grid over {results.many:,} episodes. Alone, {words.same_alone(results)}."
    )
    return f"""# From grid to house

{intro}

    {command}

{headline}

![Damage left in the grid and in the house, and where the robot's time goes](grid_to_house.png)

## Damage

{columns}

{damage_table(results)}

By kind, with the caregiver; *done* is interventions completed an episode.

{kind_table(results)}

## Where the robot's time goes

{parts}

{phase_table(results)}

{words.explanation(results)}

{words.endings(results)}

{words.budget(results)}
"""
