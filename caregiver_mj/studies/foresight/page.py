"""The page."""

from __future__ import annotations

import numpy as np
import pandas as pd

from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.experiments.verdicts import MARGINS, holm
from caregiver_mj.studies.documents import fill, table
from caregiver_mj.studies.foresight.bars import FLOOR, OURS, RULE, TOLD, Bars
from caregiver_mj.studies.foresight.measure import means
from caregiver_mj.studies.foresight.variants import ABLATIONS, key_of

_SHOWN = ("paper", "nearest", "paper-predictive", "foresight", "knows-goal", "clairvoyant", "floor")


def page(runs: list[Bars], rows: pd.DataFrame, command: str) -> str:
    """The whole page.

    Args:
        runs: Runs to judge foresight by.
        rows: What `measure` has found with all variants; or none.
        command: What has made it.
    """
    parts = [
        "# What foresight is worth",
        fill(
            "The caregiver `foresight` plans by a belief over the child's toy bin and epsilon; `knows-goal` is the "
            "same planner that is told both; `clairvoyant` knows every move that will come; the floor is what "
            "remains when nothing but bare tables is left. Intervals are 95 %, over houses."
        ),
        f"    {command}",
        *(_run(bars) for bars in runs),
    ]
    if len(rows):
        parts += ["## Taken apart", _ablations(rows)]
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
    alone = [bars.mean("none", family) for family in bars.families]
    rows = [
        (f"`{name}`", *(f"{interval(bars.left(name, f))}; {bars.mean(name, f):.2f}" for f in bars.families))
        for name in names
    ]
    note = "Share of the damage alone that is left, and after the semicolon the damage of an episode."
    last = ("*damage alone*", *(f"{damage:.2f}" for damage in alone))
    return "\n\n".join([table(("caregiver", *bars.families), [*rows, last]), note])


def _against(bars: Bars) -> str:
    rows = []
    comparisons = [bars.against(RULE, (family,)) for family in bars.families]
    corrected = holm(np.array([comparison.p for comparison in comparisons]))
    for family, comparison, p_holm in zip(bars.families, comparisons, corrected, strict=True):
        cells = [interval(comparison.estimate, "+", 3), p(p_holm), share(bars.removed((family,)))]
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
                "The p are corrected by Holm for the number of children. Excess removed: share of what the rule leaves "
                f"above the floor. Closed: share of the way from the rule to `{TOLD}`. Houses: in which foresight has "
                "less damage : as much : more than the other, whatever chance has to do with it; clear: in which the "
                "episodes show less : more, by sign flips at 5 % after Holm's correction over the houses."
            ),
        ]
    )


def _together(bars: Bars, families: tuple[str, ...]) -> str:
    houses, episodes = bars.reduction(RULE)
    alone, rule, ours = (float(two_level.house_means(bars.summed(name)).mean()) for name in ("none", RULE, OURS))
    first = (
        f"Damage of an episode, summed over {', '.join(bars.families)}: alone {alone:.2f}, with the rule {rule:.2f}, "
        f"with `{OURS}` {ours:.2f}. That is less the rule's {interval(houses.estimate, '+')} with the house as the "
        f"unit of chance (p {p(houses.p)}), {interval(episodes.estimate, '+')} with the episode (p {p(episodes.p)}): "
        f"{share(bars.gone(RULE))} of what the rule leaves is gone, {share(bars.gone(RULE, FLOOR))} of that above the "
        "floor."
    )
    comparison = bars.against(RULE, families)
    text = (
        "Each child's damage as a share of that without a caregiver, so that those who take little count as much as "
        f"those who take much, the mean over {', '.join(families)}: less the rule's "
        f"{interval(comparison.estimate, '+', 3)} (p {p(comparison.p)}); excess removed {share(bars.removed(families))}"
    )
    if TOLD in bars.caregivers:
        text += f"; closed {share(bars.closed(families))}"
    if "clairvoyant" in bars.caregivers:
        text += f". `clairvoyant` removes {share(bars.removed(families, 'clairvoyant'))} of the excess"
        least = {family: bars.houses_with(RULE, family, "clairvoyant")[0] for family in families}
        text += ", and has less damage than the rule in " + ", ".join(f"{n} ({name})" for name, n in least.items())
        text += f" of {len(bars.houses)} houses"
    return "\n\n".join([fill(first), fill(f"{text}.")])


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
