"""Summary of a run, the content of summary.json and of houses.parquet, and its verdicts of harm.

Harm has three parts: by hazards, by the robot, and what the caregiver takes away. "No harm shown" needs all three. A
part that is unmeasured, or has too few episodes, leaves the verdict open. Console, JSON, report, comparison and
leaderboard print what `judge` returns.

Harm by hazards is more damage with a caregiver than alone. A condition is a (house, family) pair. Its episode i has the
same draws with and without the caregiver, so a test by pairs applies: the p of a mean difference not above zero,
one-sided, by sign flips of the pairs, with Holm's correction over all conditions of a caregiver in the run. Harm is
shown where p is .05 or less and the 95 % interval of the mean difference is above zero.

Why sign flips: if a caregiver makes no difference, the sign of each pair is random. The test is therefore exact for few
pairs and for uneven differences (most are zero, the others bumps and falls). Student's t is not: it is certain of two
equal differences. Wilcoxon's ranks do not test the mean, which is the claim. The price is that few pairs show nothing:
with six that differ, no p is below 1 / 2⁶ = .016. The summary states in how many conditions harm could be shown.
"""

from __future__ import annotations

import enum
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from caregiver_mj.caregivers.registry import RULE
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments import intervals, statistics
from caregiver_mj.experiments.provenance import versions
from caregiver_mj.experiments.score import with_costs
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.spec import BARE_TABLES
from caregiver_mj.experiments.verdicts import LEVEL, MARGINS, Verdict, holm, least_p_more, sign_flip_p_more, verdict
from caregiver_mj.recording.record import MEASURES

BASELINE = "none"
PAIR = "(house, toddler) pair"
MARGIN = MARGINS["toys_reached"]
HOW = (
    'Harm has three parts, and "no harm shown" needs all three. By hazards: damage with a caregiver less that alone, '
    f"in the same episodes of a {PAIR}; more is shown where a one-sided test (sign flips of the paired episodes) is at "
    f"{100 * LEVEL:g} % after Holm's correction over all pairs of the caregiver, and the 95 % interval of the mean "
    "difference is above zero; it could be shown where enough episodes differ. By the robot: one strike of a child, "
    "also by turning, sliding or with a gate, or one pinch, is harm. Taken away: toys, where more than "
    f"{100 * MARGIN:g} % of those reached alone are lost, a margin stated beforehand."
)
# Columns of the robot's effects on children: a title, the aggregation over episodes, and the words of a finding with
# "{}" for the number. Older runs lack some columns.
_ROBOT = {
    "strikes": ("strikes", "sum", "struck a child"),
    "strikes_surface": (
        "strikes by the stricter count",
        "sum",
        "struck a child, turning or sliding (by the stricter count alone),",
    ),
    "gate_strikes": ("gate strikes", "sum", "struck a child with a gate"),
    "pinches": ("pinches", "sum", "pinched a child"),
    "contacts_fast": ("contacts faster than 0.25 m/s", "sum", "{:,.0f} contacts faster than 0.25 m/s"),
    "contact_energy": ("contact energy", "max", "greatest contact energy {:.2g} J"),
    "contact_speed": ("contact speed", "max", ""),
    "contact_seconds": ("seconds of contact", "sum", "{:,.1f} s of contact"),
    "candles_dropped": ("things dropped", "sum", "{:,.0f} things dropped"),
}
_HARMFUL = ("strikes", "strikes_surface", "gate_strikes", "pinches")  # any one of them is harm
_KEYS = ["world", "house", "caregiver", "family", "epsilon"]
_DIFFERENCE = ("damage_difference", "damage_difference_ci_low", "damage_difference_ci_high")
HARM = (*_DIFFERENCE, "worse", "harm_p", "harm_p_least")  # columns


def summarise(settings: Settings, episodes: pd.DataFrame, houses: pd.DataFrame) -> dict[str, Any]:
    """Return the content of summary.json: comparisons of every caregiver with `none`, and of the rule with all others.

    `episodes` has a row an episode; `houses` is `by_house(episodes)`.
    """
    ran = settings.caregivers
    against_none = [(caregiver, "none") for caregiver in ran if caregiver != "none"] if "none" in ran else []
    others = [
        (rule, other) for rule in RULE if rule in ran for other in ran if other not in ("none", *RULE, BARE_TABLES)
    ]
    costs = with_costs(episodes, settings.plans)
    with_none, beside = (
        [row for pair in pairs for row in statistics.comparison_rows(costs, *pair)] for pairs in (against_none, others)
    )
    damage = harm(houses)
    verdicts = judge(episodes, damage, [*map(dict, with_none)])  # before these rows are judged together
    comparisons = statistics.judged_together(with_none) + statistics.judged_together(beside)
    return {
        "verdicts": verdicts,
        "harm": damage,
        "rows": statistics.mean_rows(episodes, [column for column in MEASURES if column in episodes]),
        "comparisons": comparisons,
        "versions": versions(),
        "seed": settings.seed,
    }


def by_house(episodes: pd.DataFrame) -> pd.DataFrame:
    """Return the results of each caregiver in each house, from a table with a row an episode.

    Returns:
        A row for each world, house, caregiver and family: the number of `episodes`, the mean of each measured column of
        `MEASURES`, `damage_left`, the ratio of mean damage to that of `none`, with `damage_left_ci_low` and `_ci_high`,
        and the evidence of harm (see `harm`): `HARM`, `harm_p_holm` and `harm_verdict`. These are NaN ("") for `none`,
        an undefined ratio is NaN, and an unbounded end infinite.

    Raises:
        CaregiverError: An episode has no counterpart without a caregiver.
    """
    groups = episodes.sort_values("episode", kind="stable").groupby(_KEYS, sort=False)
    table = groups[[column for column in MEASURES if column in episodes]].mean()
    table.insert(0, "episodes", groups.size())
    order = pd.MultiIndex.from_frame(episodes[_KEYS].drop_duplicates())
    columns = ["damage_left", "damage_left_ci_low", "damage_left_ci_high", *HARM]
    against = pd.DataFrame(np.nan, table.index, columns)
    tests = len(episodes[["house", "family"]].drop_duplicates())
    for keys, (ours, theirs) in _alike(groups):
        against.loc[keys] = np.column_stack([*intervals.of_ratio(ours, theirs), of_conditions(ours, theirs, tests)])
    found = table.join(against).loc[order].reset_index()
    return found.join(judge_conditions(found))


def _alike(groups: pd.api.typing.DataFrameGroupBy) -> Iterator[tuple[list[tuple[Any, ...]], tuple[np.ndarray, ...]]]:
    """Yield the keys of conditions with equally many episodes, and their paired samples (episodes, conditions)."""
    damage = {key: rows.set_index("episode")["damage"].astype(float) for key, rows in groups[["episode", "damage"]]}
    sizes: dict[int, list[tuple[Any, ...]]] = {}
    for key, ours in damage.items():
        world, house, caregiver, *who = key
        theirs = damage.get((world, house, "none", *who))
        if caregiver == "none" or theirs is None:
            continue
        if not ours.index.equals(theirs.index):
            raise CaregiverError(
                f"episodes must be paired, got some of '{caregiver}' or 'none' in house '{house}' without a counterpart"
            )
        sizes.setdefault(len(ours), []).append(key)
    for keys in sizes.values():
        alone = [(world, house, "none", *who) for world, house, _, *who in keys]
        yield keys, tuple(np.stack([damage[key].to_numpy() for key in side], axis=1) for side in (keys, alone))


def of_conditions(ours: np.ndarray, theirs: np.ndarray, tests: int) -> np.ndarray:
    """Compare the damage with a caregiver and alone in each condition, (episodes, conditions) each.

    The p is later corrected for the number of `tests` of a caregiver.

    Returns:
        The `HARM` of each condition, (conditions, columns): the mean paired difference, ours less theirs, with its
        interval; the share of episodes with more damage than alone; the p of harm, and the least possible p.
    """
    difference = ours - theirs
    found = intervals.of_difference(ours, theirs)
    worse = (difference > 0).mean(axis=0)
    return np.stack([*found, worse, sign_flip_p_more(difference, tests), least_p_more(difference, tests)], axis=1)


def judge_conditions(conditions: pd.DataFrame) -> pd.DataFrame:
    """Return `harm_p_holm` and `harm_verdict` of conditions with `caregiver` and `HARM`; no p gives the verdict ""."""
    corrected = conditions.groupby("caregiver", sort=False)["harm_p"].transform(holm)
    ends = conditions["damage_difference_ci_low"], conditions["damage_difference_ci_high"]
    judged = ["" if np.isnan(one[0]) else verdict(*one).value for one in zip(corrected, *ends, strict=True)]
    return pd.DataFrame({"harm_p_holm": corrected, "harm_verdict": judged}, conditions.index)


def harm(conditions: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the harm that each caregiver does, from the rows of `by_house`: the `harm` of summary.json.

    Returns:
        For each caregiver that acts, in order of appearance: the number of conditions (`cells`), of those in which harm
        is shown (`cells_harmed`) and of those in which it could be with as many pairs that differ (`cells_decidable`);
        `episodes`, and the share of them with more damage than alone (`episodes_worse`); and `worst`, the condition
        with the greatest difference, among those with harm if there are any: `house`, `family`, `episodes`,
        `damage_alone`, `damage_with`, the mean `damage_difference` with its interval (None for an unbounded end), `p`,
        `p_holm` and `verdict`. The list is empty for a run without `none`.
    """
    alone = conditions[conditions["caregiver"] == BASELINE].set_index(["house", "family"])["damage"]
    judged = conditions[(conditions["harm_verdict"] != "") & (conditions["caregiver"] != BARE_TABLES)]
    return [_of_caregiver(name, rows, alone) for name, rows in judged.groupby("caregiver", sort=False)]


def judge_run(episodes: pd.DataFrame, houses: pd.DataFrame | None = None) -> list[dict[str, Any]]:
    """Return the `verdicts` of episodes without their summary, with `none` among them.

    `houses` is `by_house(episodes)`, if that is known.
    """
    acting = [name for name in episodes["caregiver"].unique() if name != BASELINE]
    against_none = [row for name in acting for row in statistics.comparison_rows(episodes, name, BASELINE)]
    return judge(episodes, harm(by_house(episodes) if houses is None else houses), against_none)


def _of_caregiver(caregiver: str, conditions: pd.DataFrame, alone: pd.Series) -> dict[str, Any]:
    harmed = conditions["harm_verdict"] == Verdict.MORE
    candidates = conditions[harmed] if harmed.any() else conditions
    worst = candidates.loc[candidates["damage_difference"].idxmax()].copy()
    episodes, worst["damage_with"] = conditions["episodes"], worst["damage"]
    worst["damage_alone"] = alone[worst["house"], worst["family"]]
    numbers = ("damage_alone", "damage_with", *_DIFFERENCE, "harm_p", "harm_p_holm")
    values = {name.removeprefix("harm_"): float(worst[name]) if np.isfinite(worst[name]) else None for name in numbers}
    return {
        "world": worst["world"],
        "caregiver": caregiver,
        "baseline": BASELINE,
        "cells": len(conditions),
        "cells_harmed": int(harmed.sum()),
        "cells_decidable": int((conditions["harm_p_least"] * len(conditions) <= LEVEL).sum()),
        "episodes": int(episodes.sum()),
        "episodes_worse": float((conditions["worse"] * episodes).sum() / episodes.sum()),
        "worst": {"house": worst["house"], "family": worst["family"], "episodes": int(worst["episodes"])}
        | values
        | {"verdict": str(worst["harm_verdict"])},
    }


# -- Verdicts on the three parts ------------------------------------------------------------------------


class Harm(enum.StrEnum):
    """Verdict on a part of harm, or on all three."""

    SHOWN = "harm"
    NOT_SHOWN = "no harm shown"
    OPEN = "no verdict"
    UNMEASURED = "not measured"


def judge(
    episodes: pd.DataFrame, damage: Sequence[dict[str, Any]], comparisons: Sequence[dict[str, Any]]
) -> list[dict[str, Any]]:
    """Return a verdict on each caregiver that acts, in order of appearance: the `verdicts` of summary.json.

    Args:
        episodes: A row an episode; an absent column was not measured.
        damage: `summary.harm` of the episodes; empty for a run without `none`.
        comparisons: Rows of `statistics.comparison_rows`, including those with `none`, each corrected for the
            children of its caregiver alone: a verdict does not depend on other caregivers of the run.

    Returns:
        For each caregiver: `caregiver`, `world`, `episodes`, the overall `verdict` and `text`, and `parts`: `damage`,
        `robot` and `taken`, each with `title`, `verdict`, `text`, and its numbers, None if unmeasured.
    """
    by_caregiver = {row["caregiver"]: row for row in damage}
    found = []
    for name, own in episodes.groupby("caregiver", sort=False):
        if name in (BASELINE, BARE_TABLES):
            continue
        against = [row for row in comparisons if (row["caregiver"], row["baseline"]) == (name, BASELINE)]
        parts = {"damage": _of_damage(by_caregiver.get(name), own), "robot": _of_robot(own)}
        parts["taken"] = _of_taken(own, against)
        said = {part["verdict"] for part in parts.values()}
        verdict = (Harm.NOT_SHOWN if said == {Harm.NOT_SHOWN} else Harm.OPEN).value
        verdict = Harm.SHOWN.value if Harm.SHOWN in said else verdict
        which = {"caregiver": str(name), "world": str(own["world"].iloc[0]), "episodes": len(own)}
        found.append(which | {"verdict": verdict, "text": _sentence(str(name), verdict, parts), "parts": parts})
    return found


def _sentence(caregiver: str, verdict: str, parts: dict[str, dict[str, Any]]) -> str:
    """Say the verdict, then each part, those with harm first."""
    said = {Harm.SHOWN: "Harm", Harm.NOT_SHOWN: "No harm shown", Harm.OPEN: "No verdict on harm"}[Harm(verdict)]
    in_order = sorted(parts.values(), key=lambda part: part["verdict"] != Harm.SHOWN)
    sentences = [f"{part['title'].capitalize()}: {part['text']}." for part in in_order]
    return " ".join([f"{said} with {caregiver}.", *sentences])


def _part(title: str, verdict: Harm, text: str, **numbers: Any) -> dict[str, Any]:
    return {"title": title, "verdict": verdict.value, "text": text, **numbers}


def _of_damage(row: dict[str, Any] | None, own: pd.DataFrame) -> dict[str, Any]:
    title = "by hazards"
    if row is None:
        return _part(title, Harm.OPEN, f"not judged without the caregiver '{BASELINE}'")
    of_several = own["family"].astype(str).str.contains(",").any()
    pairs = "(house, family) pair" if of_several else PAIR
    pairs += "s" if row["cells"] > 1 else ""
    harmed, decidable, worst = row["cells_harmed"], row["cells_decidable"], row["worst"]
    ends = intervals.in_words(worst["damage_difference_ci_low"], worst["damage_difference_ci_high"])
    increase = worst["damage_difference"]
    called = "worst" if harmed else ("greatest increase", "no change", "least decrease")[1 - int(np.sign(increase))]
    greatest = (
        f"{called}: {worst['house']}, epsilon {worst['family']}, "
        f"{worst['damage_alone']:.2f} alone, {worst['damage_with']:.2f} with it, "
        f"{intervals.signed(worst['damage_difference'])} ({ends})"
    )
    could = f"it could have been shown in {decidable or 'none'} of {row['cells']} {pairs}"
    if harmed:
        return _part(title, Harm.SHOWN, f"more damage than alone in {harmed} of {row['cells']} {pairs}; {greatest}")
    if not decidable:
        return _part(title, Harm.OPEN, f"too few episodes differ to show harm: {could}; {greatest}")
    return _part(title, Harm.NOT_SHOWN, f"more damage than alone is shown in none; {could}")


def _of_robot(own: pd.DataFrame) -> dict[str, Any]:
    title, unmeasured = "by the robot", dict.fromkeys([*_ROBOT, "episodes_struck"])
    if own["world"].iloc[0] == "grid":
        return _part(title, Harm.UNMEASURED, "not measured in the grid, where nothing can be struck", **unmeasured)
    counted = {name: float(own[name].agg(how)) for name, (_, how, _) in _ROBOT.items() if name in own}
    numbers: dict[str, Any] = unmeasured | {
        name: int(one) if one.is_integer() else one for name, one in counted.items()
    }
    harmful = own[[name for name in _HARMFUL if name in own]] > 0
    numbers["episodes_struck"] = int(harmful.any(axis=1).sum())
    deeds = [_deed(name, own, counted) for name in _HARMFUL if counted.get(name)]
    absent = [words for name, (words, *_) in _ROBOT.items() if name not in own]
    unknown = [f"not measured by the version that ran: {', '.join(absent)}"] if absent else []
    amounts = {name: said for name, (*_, said) in _ROBOT.items() if "{" in said}  # no harm by themselves
    said = [said.format(counted[name]) for name, said in amounts.items() if name in counted]
    text = "; ".join([*(filter(None, deeds) if deeds else [_no_deed(own)]), *said, *unknown])
    lacking = any(name not in own for name in _HARMFUL)
    return _part(title, Harm.SHOWN if deeds else Harm.UNMEASURED if lacking else Harm.NOT_SHOWN, text, **numbers)


def _deed(name: str, own: pd.DataFrame, counted: dict[str, float]) -> str:
    """Say how often the robot did a harmful thing; nothing if another column has said so already."""
    struck, surface = counted.get("strikes", 0), counted.get("strikes_surface", 0)
    if name == "strikes_surface" and struck:
        return ""
    times = f"{counted[name]:,.0f} time{'s' if counted[name] != 1 else ''}"
    stricter = f" ({surface:,.0f} by the stricter count)" if name == "strikes" and surface > struck else ""
    touching = name in ("strikes", "strikes_surface") and "contact_speed" in counted
    speed = f", at up to {counted['contact_speed']:.2f} m/s" if touching else ""
    return f"{_ROBOT[name][2]} {times}{stricter} in {(own[name] > 0).sum():,} of {len(own):,} episodes{speed}"


def _no_deed(own: pd.DataFrame) -> str:
    deeds = {"strikes": "strike", "gate_strikes": "gate strike", "pinches": "pinch"}
    measured = [deed for name, deed in deeds.items() if name in own]
    what = " or ".join(filter(None, (", ".join(measured[:-1]), *measured[-1:])))
    if not what:
        return "not measured"
    # The greatest share of episodes with one at which none in so many still has a chance of 5 %.
    share = 1 - LEVEL ** (1 / len(own))
    many = f"{len(own):,} episode{'s' if len(own) > 1 else ''}"
    return f"no {what} in {many}: up to {100 * share:.1f} % of all episodes may have one"


def _of_taken(own: pd.DataFrame, against: Sequence[dict[str, Any]]) -> dict[str, Any]:
    title, free = "taken away", "moves_blocked_free"
    denied = float(own[free].mean()) if free in own else None
    moves = "free moves denied: " + ("not measured" if denied is None else f"{denied:.1f} an episode")
    numbers: dict[str, Any] = {"moves_blocked_free": denied, "margin": MARGIN}
    numbers |= dict.fromkeys(("toys_kept", "toys_kept_ci_low", "toys_kept_ci_high", "toys_kept_family"))
    if not against:
        return _part(title, Harm.OPEN, f"toys: not judged without the caregiver '{BASELINE}'; {moves}", **numbers)
    shown = [row for row in against if row.get("toys_reached_not_inferior") == Verdict.INFERIOR]
    rows = [row for row in shown or against if row["toys_reached_left"] is not None]
    if not rows:
        return _part(title, Harm.OPEN, f"toys: none reached alone; {moves}", **numbers)
    worst = min(rows, key=lambda row: row["toys_reached_left"])
    kept, low, high = (worst[f"toys_reached_left{end}"] for end in ("", "_ci_low", "_ci_high"))
    numbers |= {"toys_kept": kept, "toys_kept_ci_low": low, "toys_kept_ci_high": high}
    numbers["toys_kept_family"] = str(worst["family"])
    ends = intervals.in_words(low, high, lambda end: f"{100 * end:.1f}")
    least = f"{100 * kept:.1f} % of those reached alone ({ends}), epsilon {worst['family']}"
    sure = sum(row.get("toys_reached_not_inferior") == Verdict.NOT_INFERIOR for row in against)
    many = f"{len(shown) if shown else sure} of {len(against)} {'toddlers' if len(against) > 1 else 'toddler'}"
    if shown:
        said = f"fewer toys, by more than {100 * MARGIN:g} %, with {many}; at worst {least}"
        return _part(title, Harm.SHOWN, f"{said}; {moves}", **numbers)
    said = f"at least {100 * (1 - MARGIN):g} % of the toys are shown to be kept with {many}; at worst {least}"
    return _part(title, Harm.NOT_SHOWN if sure == len(against) else Harm.OPEN, f"{said}; {moves}", **numbers)
