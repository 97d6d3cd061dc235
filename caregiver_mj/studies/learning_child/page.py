"""The page: what was done, tables, and what they say."""

from __future__ import annotations

import numpy as np

from caregiver_mj.experiments import two_level
from caregiver_mj.studies.documents import fill, table
from caregiver_mj.studies.learning_child.learner import DISCOUNT, RATE, TEMPERATURE
from caregiver_mj.studies.learning_child.life import KINDS
from caregiver_mj.studies.learning_child.measure import NONE, Grown
from caregiver_mj.studies.learning_child.words import FIRST, against, interval, number, words


def page(grown: Grown, houses: str, epsilon: float, command: str) -> str:
    """The whole page.

    Args:
        grown: The children.
        houses: Name of the set of houses.
        epsilon: Share of random moves.
        command: What prints this page.
    """
    parts = [
        "# The child learns",
        fill(
            "The paper hopes that a child, or a robot, that is better protected can learn more. Here a novice "
            f"learns, in the grid: {grown.learners} children of each kind, with each caregiver, in each of "
            f"{grown.houses} houses of `{houses}`. Every child has the same chance under every caregiver. Intervals "
            "are 95 %, with the house as unit of chance; *spread* is the standard deviation between the children of "
            "one house, the mean over houses. All of this page is printed by"
        ),
        f"    {command}",
        "![Damage, return, coverage and what is known of danger, over the episodes of a life](learning_child.png)",
        "Lines are means; bands have the middle half of the children of a house, on average over houses.",
        "## The child",
        fill(
            "A tabular Q-learner. It knows its cell and the bin that it goes to; a toy is worth 1, damage counts as "
            f"it is (5 stairs, 4 candle, 1 table), negative. Learning rate {RATE:g}, discount {DISCOUNT:g} a move, "
            "all values 0 at first; from every move it learns for all bins, and at the end of an episode it goes "
            "over its moves once more, the last one first. It does not see the caregiver, nor which table has a "
            f"candle. A share {epsilon:g} of its moves is random, at every age: the *careless* child draws them "
            "among all four moves alike, as the paper's novice does; the *wary* child in proportion to exp(value / "
            f"{TEMPERATURE:g}), so that what it knows of danger counts in them, too. Every episode has 200 "
            "timesteps, and the candles back on their tables."
        ),
        "## While it is there",
        _childhood(grown),
        "## When it leaves",
        _leaving(grown),
        "## If it left earlier",
        _exams(grown),
        "## What that says",
        words(grown),
    ]
    return "\n\n".join(parts) + "\n"


def _childhood(grown: Grown) -> str:
    last = grown.childhood
    spans = {f"first {FIRST}": (0, FIRST), f"last {FIRST}": (last - FIRST, last)}
    rows = []
    for kind in KINDS:
        for name in (NONE, *grown.guards):
            cells = []
            for measure in ("damage", "toys", "coverage"):
                cells += [number(grown.mean(name, measure, kind, *span), 2) for span in spans.values()]
            whole = [one * last for one in grown.mean(name, "damage", kind, 0, last)]
            rows.append((kind, f"`{name}`", *cells, number(whole, 0)))
    titles = [f"{what}, {when}" for what in ("damage", "toys", "coverage") for when in spans]
    return (
        fill(
            f"Means an episode, of the first {FIRST} and the last {FIRST} of the {last} episodes of childhood, and "
            "all damage in it. Coverage is the share of the free cells that are visited before the damage is above "
            "15."
        )
        + "\n\n"
        + table(("child", "caregiver", *titles, "damage in childhood"), rows)
    )


def _leaving(grown: Grown) -> str:
    start, end = grown.childhood, grown.childhood + grown.after
    spans = {"before": (start - 1, start), "soon": (start, start + FIRST), "later": (start + FIRST, end)}
    rows = []
    for kind in KINDS:
        for name in (NONE, *grown.guards):
            damage, toys = (
                {when: grown.mean(name, measure, kind, *span) for when, span in spans.items()}
                for measure in ("damage", "toys")
            )
            spread = np.mean([one.std(ddof=1) for one in damage["soon"]])
            shunned = grown.mean(name, "known", kind, *spans["before"])
            differences = [
                interval(against(found, grown.mean(NONE, measure, kind, *spans[when])), 2, "+")
                for measure, when, found in (
                    ("known", "before", shunned),
                    ("damage", "soon", damage["soon"]),
                    ("damage", "later", damage["later"]),
                    ("toys", "soon", toys["soon"]),
                )
            ]
            life = number([one * end for one in grown.mean(name, "damage", kind, 0, end)], 0)
            now = f"{number(damage['soon'], 2)}, {spread:.2f}"
            shown = ["–"] * len(differences) if name == NONE else differences
            rows.append((kind, f"`{name}`", number(shunned, 2), shown[0], now, *shown[1:], life))
    titles = (
        "child",
        "grown up with",
        "dangerous moves shunned",
        "less `none`'s",
        f"damage in the first {FIRST}, spread",
        "less `none`'s",
        f"in the next {grown.after - FIRST}, less `none`'s",
        f"toys in the first {FIRST}, less `none`'s",
        "damage in a life",
    )
    text = fill(
        f"From episode {start + 1} on all are alone, and go on learning. Means an episode; *none* are those that "
        "have been alone all the time, in the same episodes of their lives. *Dangerous moves shunned* is the share "
        "of the moves into stairwells, and into tables that bear a candle at first, that the child believes to do "
        "harm when the caregiver leaves."
    )
    return f"{text}\n\n{table(titles, rows)}"


def _exams(grown: Grown) -> str:
    rows = []
    for kind in KINDS:
        for name in (NONE, *grown.guards):
            value = two_level.of_mean(grown.exam(name, kind))
            cells = (interval(value.column(i), 1) for i in range(len(grown.exams)))
            rows.append((kind, f"`{name}`", *cells))
    return (
        fill("Damage in one episode alone, in which nothing is learnt, at several ages (episodes lived).")
        + "\n\n"
        + table(("child", "grown up with", *(f"at {age}" for age in grown.exams)), rows)
    )
