"""The page."""

from __future__ import annotations

import numpy as np
import pandas as pd

from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.experiments.verdicts import MARGINS
from caregiver_mj.studies.documents import fill, table
from caregiver_mj.studies.foresight import price
from caregiver_mj.studies.foresight.bars import FLOOR, OURS, RULE, TOLD, Bars
from caregiver_mj.studies.foresight.measure import means
from caregiver_mj.studies.foresight.variants import ABLATIONS, key_of

_SHOWN = ("paper", "nearest", "paper-predictive", "foresight", "knows-goal", "clairvoyant", "floor")


def page(runs: list[Bars], rows: pd.DataFrame, prices: pd.DataFrame, command: str) -> str:
    """The whole page.

    Args:
        runs: Runs to judge foresight by.
        rows: What `measure` has found with all variants; or none.
        prices: The same with those of `price`; or none.
        command: What has made it.
    """
    parts = [
        "# What foresight is worth",
        fill(
            "The caregiver `foresight` plans by a belief over the child's toy bin and epsilon; `knows-goal` is the "
            "same planner that is told both; `clairvoyant` knows every move that will come; the floor is what blocking "
            "and relocating cannot prevent. Intervals are 95 %, over houses."
        ),
        f"    {command}",
        *(_run(bars) for bars in runs),
    ]
    if len(rows):
        parts += ["## Taken apart", _ablations(rows)]
    if len(prices):
        parts.append(price.section(prices))
    return "\n\n".join(parts) + "\n"


def _run(bars: Bars) -> str:
    below = tuple(name for name in bars.families if name != "1")
    parts = [f"## {bars.name}: {len(bars.houses)} houses", "### Damage left", _left(bars)]
    if RULE in bars.caregivers and FLOOR in bars.caregivers:
        parts += ["### Against the rule", _against(bars), _together(bars, below)]
    parts += ["### What the child pays", _child(bars)]
    return "\n\n".join(parts)


def _left(bars: Bars) -> str:
    names = [name for name in _SHOWN if name in bars.caregivers]
    rows = [(f"`{name}`", *(interval(bars.left(name, family)) for family in bars.families)) for name in names]
    return table(("caregiver", *bars.families), rows)


def _against(bars: Bars) -> str:
    rows = []
    for family in bars.families:
        comparison = bars.against(RULE, (family,))
        cells = [interval(comparison.estimate, "+", 3), p(comparison.p), share(bars.removed((family,)))]
        cells.append(share(bars.closed((family,))) if TOLD in bars.caregivers else "–")
        for other in (RULE, "nearest"):
            if other not in bars.caregivers:
                cells += ["–", "–"]
                continue
            cells.append(" : ".join(str(n) for n in bars.houses_with(other, family)))
            cells.append(" : ".join(str(n) for n in bars.clear(other, family)))
        rows.append((family, *cells))
    titles = (
        "child",
        "left, less the rule's",
        "p",
        "excess removed",
        "closed",
        "houses, rule",
        "clear",
        "houses, nearest",
    )
    return "\n\n".join(
        [
            table((*titles, "clear"), rows),
            fill(
                "Excess removed: share of what the rule leaves above the floor. Closed: share of the way from the rule "
                f"to `{TOLD}`. Houses: in which foresight has less damage : as much : more than the other, whatever "
                "chance has to do with it; clear: in which an interval over episodes leaves no doubt of less : more."
            ),
        ]
    )


def _together(bars: Bars, families: tuple[str, ...]) -> str:
    comparison = bars.against(RULE, families)
    text = (
        f"Mean over {', '.join(families)}: damage less the rule's {interval(comparison.estimate, '+', 3)} of that "
        f"without a caregiver (p {p(comparison.p)}); excess removed {share(bars.removed(families))}"
    )
    if TOLD in bars.caregivers:
        text += f"; closed {share(bars.closed(families))}"
    if "clairvoyant" in bars.caregivers:
        text += f". `clairvoyant` removes {share(bars.removed(families, 'clairvoyant'))} of the excess"
        least = {family: bars.houses_with(RULE, family, "clairvoyant")[0] for family in families}
        text += ", and has less damage than the rule in " + ", ".join(f"{n} ({name})" for name, n in least.items())
        text += f" of {len(bars.houses)} houses"
    houses, episodes = bars.pooled(RULE)
    text += (
        f". Of all episodes, an episode's damage less the rule's: {interval(houses.estimate, '+')} with the house as "
        f"the unit of chance (p {p(houses.p)}), {interval(episodes.estimate, '+')} with the episode (p {p(episodes.p)})"
    )
    return fill(f"{text}.")


def _child(bars: Bars) -> str:
    rows = []
    for family in bars.families:
        toys, verdict = bars.toys(family)
        denied, more = bars.denied(family)
        rows.append((family, share(toys), str(verdict), f"{denied:.2f}", interval(more, "+")))
    head = ("child", "toys kept", f"< {MARGINS['toys_reached']:.0%} lost?", "free moves denied", "less the rule's")
    return table(head, rows)


def _ablations(rows: pd.DataFrame) -> str:
    found = means(rows)
    families = [f"{epsilon:g}" for epsilon in EPSILONS]
    left = {f: found.xs(f, level="family").damage / found.xs(f, level="family").damage["none"] for f in families}
    bars = Bars("", rows)
    parts = []
    for what, ways in ABLATIONS.items():
        lines = []
        for how in ways:
            key = key_of(what, how)
            mean = found.xs(key, level="caregiver")
            more = "" if key == OURS else interval(bars.against(OURS, tuple(families[1:]), key).estimate, "+", 3)
            cells = [f"{left[f][key]:.3f}" for f in families]
            toys = found.toys_reached.xs(key, level="caregiver")[families[1:]].sum()
            alone = found.toys_reached.xs("none", level="caregiver")[families[1:]].sum()
            denied, begun = mean.moves_blocked_free[families[1:]].mean(), mean.interventions[families[1:]].mean()
            lines.append((how, *cells, more, f"{toys / alone:.1%}", f"{denied:.2f}", f"{begun:.0f}"))
        head = (what, *families, "mean below 1, less foresight's", "toys kept", "free moves denied", "begun")
        parts.append(table(head, lines))
    houses, episodes = rows.house.nunique(), rows.episode.nunique()
    note = (
        f"Damage left over {houses} houses of {episodes} episodes a cell, that used to find what foresight reckons "
        "with; toys, free moves denied and interventions begun below epsilon 1. The first line of each table is "
        "foresight as it is."
    )
    return "\n\n".join([fill(note), *parts, "![Damage left against what the child pays](foresight.svg)"])


def interval(estimate: Estimate[float], sign: str = "", digits: int = 2) -> str:
    """An estimate with its interval."""
    value, low, high = (f"{round(one, digits) + 0.0:{sign}.{digits}f}" for one in estimate)
    return f"{value} ({low} to {high})" if np.isfinite(estimate).all() else f"{value} (–)"


def share(estimate: Estimate[float]) -> str:
    """The same in percent."""
    value, low, high = (f"{100 * one:.0f}" for one in estimate)
    return f"{value} % ({low} to {high})" if np.isfinite(estimate).all() else f"{value} % (–)"


def p(value: float) -> str:
    """A p, or a dash where there can be none."""
    return "–" if np.isnan(value) else "< .001" if value < 0.001 else f"{value:.3f}".lstrip("0")
