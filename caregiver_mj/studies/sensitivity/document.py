"""The page docs/sensitivity.md."""

from __future__ import annotations

import pandas as pd

from caregiver_mj.studies.documents import fill
from caregiver_mj.studies.sensitivity import same_rule_table, tables, words
from caregiver_mj.studies.sensitivity.house import HOUSE
from caregiver_mj.studies.sensitivity.house_table import house_table
from caregiver_mj.studies.sensitivity.results import Results


def document(results: Results, episodes: pd.DataFrame, command: str) -> str:
    """The text of the page, which a command prints.

    Args:
        results: The grid's.
        episodes: The house's; empty if there are none.
        command: What to call for it.
    """
    told = (
        f"{len(place.houses)} houses with {place.episodes:,} episodes each in {place}"
        if len(place.houses) > 1
        else f"{place.episodes:,} episodes on {place}"
        for place in results.places
    )
    intro = fill(
        "How the results depend on what the paper leaves open, or what others would have chosen otherwise. In the "
        f"grid: {words.listed(list(told))}, for each epsilon, the same novices throughout. *Left* is damage over that "
        "of the same children without a caregiver; in brackets 95 % intervals, over episodes in a single house, and "
        "over houses and then episodes in a set of them. All of this page is printed by"
    )
    parts = (_weights(results), _reach(results), _threshold(results), _speed(results), _yielding(results))
    house = [_house(episodes)] if len(episodes) else []
    body = "\n\n".join([*parts, *house, _same_rule(results)])
    return f"""# Sensitivity

{intro}

    {command}

![Damage left, by what is varied](sensitivity.svg)

{body}
"""


def _weights(results: Results) -> str:
    intro = fill(
        "What a fall down the stairs, a bump into a table with a candle and one into a bare table cost; 5:4:1 is the "
        "paper's. They say what is counted, and they are what the rule goes by; `nearest` does not know them. Damage "
        "of `paper` less that of `nearest`, in the same episodes, with its interval:"
    )
    why = fill(
        f"{words.dear_stairs(results)} At inverse distance a stairwell that costs 20 outweighs a candle that costs 4 "
        "from up to five times as far. So the robot stands in a stairwell to which the child may not be heading, while "
        "the candle beside the child stays: fewer falls, for more bumps at candles. Whether that pays depends on the "
        "plan and on the child."
    )
    return f"""## What a collision costs

{intro}

{tables.weights_difference(results)}

{words.weights(results)}

{why}

Collisions an episode, over all epsilons:

{tables.weights_collisions(results)}

What is left of the damage:

{tables.weights_left(results)}"""


def _reach(results: Results) -> str:
    reason = fill(
        'The paper represents P(reach) "by the normalized distance of the agent from o". A distance grows where a '
        "probability falls, so something has to turn it round. *Inverse*: 1 / d, normalised so that the hazards' sum "
        "to 1. *Linear*: 1 - d / D, with the largest distance D in the house. The default is the inverse one: it is "
        "a distribution over the hazards, as a probability of which is reached is; and it does not depend on a far "
        "corner of the house, as D does. With the linear one a stairwell at s moves outweighs a candle beside the "
        "child (d = 1) while 5 s < D + 4, so in a house with D = 30 from up to 6 moves away."
    )
    result = fill(
        f"{words.readings(results)} So the choice is in the rule's favour, and the paper's words do not settle it."
    )
    return f"""## P(reach)

{reason}

{tables.reach(results)}

{result}"""


def _threshold(results: Results) -> str:
    intro = fill(
        'The paper ends an interaction when a child has sustained "above a critical threshold of damage '
        '(corresponding to 15 ...)". Mean timestep in which that is so if it means more than 15, which is what this '
        f"package does, and if 15 is enough; 200 where it never comes. {words.thresholds(results)} Total damage over "
        "200 timesteps, on which everything else on this page rests, does not depend on it."
    )
    return f"""## When an interaction ends

{intro}

{tables.stops(results)}"""


def _speed(results: Results) -> str:
    intro = fill("Damage left by how many actions the caregiver has in a novice timestep; the paper's are 3.")
    return f"""## The caregiver's speed

{intro}

{tables.speeds(results)}"""


def _yielding(results: Results) -> str:
    intro = fill(
        "The paper does not say what its caregiver does where the child bars its way, or when there is nothing to do. "
        "Ours makes room: it follows or steps aside, and keeps off the child's ways. `paper-still` does not: it stays "
        f"where it is. {words.yields(results)}"
    )
    return f"""## Making room

{intro}

{tables.yielding(results)}"""


def _house(episodes: pd.DataFrame) -> str:
    count = len(episodes) // len(episodes[["robot", "epsilon"]].drop_duplicates())
    intro = fill(
        f"The same in the physical house `{HOUSE}`, {count} episodes for each robot and epsilon, the same novices. A "
        "slower robot has its base's highest speed scaled, and accelerates and turns as before."
    )
    strikes, drops = int(episodes.strikes.sum()), int(episodes.candles_dropped.sum())
    return f"""## Speed and making room in the physical house

{intro}

{house_table(episodes)}

{fill(f"In all of these {len(episodes)} episodes there were {strikes} strikes and {drops} dropped candles.")}"""


def _same_rule(results: Results) -> str:
    derivation = fill(
        "With one child at d_o moves from hazard o, of damage D_o, equations (1) and (2) say E(o) = (1 - P(safe)) D_o "
        "(1 / d_o) / sum of 1 / d. The first factor and the sum are the same for all hazards, so the rule protects "
        "from the hazard of greatest D_o / d_o, and `nearest` from that of greatest 1 / d_o. Among stairwells, or "
        "among candles, that is the same one. Let the nearest stairwell be s moves away, and the nearest candle that "
        "is worth moving c. What is equal goes to the stairwell, which comes first in the table of hazards: `nearest` "
        "takes it if s <= c, the rule if 5 / s >= 4 / c. So they differ where c < s <= 5 c / 4, which no whole numbers "
        f"are with c < 4. They are, in moves to candle and stairwell, {words.distances(5, 4)} and so on; with 4 and 5 "
        "both dangers are equal, and only the order in the table decides. With damage 20:4 they differ wherever "
        f"c < s <= 5 c ({words.distances(20, 4)} and so on), with 1:1 nowhere."
    )
    meaning = fill(
        "*Cells* is the share of a child's cells in which the two want something else, with the candles where they "
        "are at first, for both sets of weights; *timesteps* the share of those of all episodes, with 5:4:1, at whose "
        "end `nearest` would set about something else than `paper`; and the damage an episode that this makes, over "
        f"all epsilons. {words.apart(results)}"
    )
    return f"""## `paper` and `nearest` are the same rule but where every hazard is four or more moves away

{derivation}

{meaning}

{same_rule_table.same_rule_table(results)}"""
