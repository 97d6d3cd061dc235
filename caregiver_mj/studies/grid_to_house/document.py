"""The page docs/grid_to_house.md."""

from __future__ import annotations

from caregiver_mj.studies.documents import fill
from caregiver_mj.studies.grid_to_house import words
from caregiver_mj.studies.grid_to_house.phases import FULL_RATE, STOPPED_RATE
from caregiver_mj.studies.grid_to_house.results import Results
from caregiver_mj.studies.grid_to_house.rows import RULE
from caregiver_mj.studies.grid_to_house.tables import damage_table, kind_table, phase_table, step_table

_STEPS = """\
The grid's caregiver is made to lack, one after the other, what the robot lacks, in the same houses with the same
novices. *Deciding once*: it decides before the first of its three actions in a timestep, and carries on with that for
the rest of it.
"""
_RULE = """\
The rule looks at the child and at candles, and the child makes one move a timestep; so it could change its mind only
after it has put a candle down, when the robot decides anew as well. This is the most that it can cost.
"""
_OTHERS = """\
The robot decides once a timestep, too, but anew after it has put a candle down; so this is the most that it can cost.
"""
_LIKE_WITH_LIKE = """\
What else differs counts as not explained. In the grid a child moves at once, then the caregiver; a child is blocked if
the caregiver is in the cell that it goes to. In the house both move at a time: a child is blocked where it touches the
robot, so one whose way the robot crosses in mid-move is not always blocked, and a fall or a bump comes some time after
the robot has seen where the child is going. Nor has the grid grasps that miss, or a robot that gives something up.
"""


def page_name(results: Results) -> str:
    """What the page is called, and its figures begin with."""
    caregiver = results.rows.caregiver
    return "grid_to_house" if caregiver == RULE else f"grid_to_house_{caregiver}"


def document(results: Results, commands: list[str]) -> str:
    """The text of the page, which commands print."""
    rows, name = results.rows, page_name(results)
    rule = rows.caregiver == RULE
    title = "From grid to house" if rule else f"From grid to house with `{rows.caregiver}`"
    epsilons = ", ".join(f"{e:g}" for e in rows.epsilons)
    intro = fill(
        f"The caregiver `{rows.caregiver}` in {len(rows.houses)} houses (`{rows.settings.place}`), {rows.episodes} "
        f"episodes in each for each epsilon of {epsilons}: the same novices in the grid and in the physical house. All "
        "of this page is printed by"
    )
    columns = fill(
        "Mean damage an episode alone and with the caregiver, what is left of it, and *house / grid*, the ratio of "
        "mean damages with the caregiver over all houses; *all* is the mean over the epsilons. In brackets: 95 % "
        f"intervals over houses.{words.aside(results)} {words.checks(results)}"
    )
    parts = fill(
        f"Completed phases of {len(results.seconds)} watched episodes, in seconds, mean (median). *Grid*: cells on the "
        "shortest way times a third of a novice timestep, and one action more to get or place. *Clear*: what the base "
        "would drive in an empty house, from rest. *House*: what it took, which is the sum of the five that follow: "
        f"driving at full rate (round the child, too), slowed for it (below {FULL_RATE:.0%} of the planned speed), "
        f"stopped for it (below {STOPPED_RATE:.0%}, or waiting for a way), stepping aside for it, and the hand, from "
        "when the base has arrived until the phase is over."
    )
    printed_by = "\n".join(f"    {command}" for command in commands)
    many = f"Over {results.many} episodes in each house for each epsilon; what is not explained, over {rows.episodes}."
    return f"""# {title}

{intro}

{printed_by}

{fill(words.headline(results))}

![House over grid, every house a point]({name}.png)

{columns}

{damage_table(results)}

## What the house costs

{fill(words.blame(results))}

![From the grid to the house, step by step]({name}_steps.png)

{step_table(results)}

{fill(f"In units of the grid's damage, with 95 % intervals over houses. {many}")}

{fill(f"{_STEPS}{_RULE if rule else _OTHERS}{words.handicaps(results)}")}

{fill(_LIKE_WITH_LIKE)}

## Where the robot's time goes

{fill(words.delay(results))}

![Seconds of a phase]({name}_time.png)

{parts}

{phase_table(results)}

{fill(words.endings(results))}

{fill(words.budget(results))}

## Damage by kind

Mean damage an episode with the caregiver; *done* is interventions completed.

{kind_table(results)}
"""
