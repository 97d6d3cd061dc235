"""What a reader must know before comparing anything here with the paper."""

from __future__ import annotations

from collections.abc import Sequence

from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.viz.report import published
from caregiver_mj.viz.report.run import Run

FITTED = (
    "House `paper` is not the house of the paper: that is its Figure 1, which we lack. It was chosen, of many plans, "
    "for coming closest to the paper's Tables I and II, to levels and to differences. So agreement with the paper in "
    "it validates nothing; what a caregiver is worth shows in houses that nobody chose."
)
EPSILON = (
    "Epsilon is the share of moves that are random, as in the names of the paper's novices; the paper's text (section "
    "V.B) writes epsilon for the other share."
)
SAME_RULE = (
    "`nearest` and `paper` are the same rule but where every hazard left is four or more moves away: with one child "
    "1 - P(safe) and what normalises distances are common to all hazards and cancel, and 5 (stairwell) against 4 "
    "(candle) decides only between distances such as 5 and 4."
)


def disclosures(runs: Sequence[Run]) -> list[str]:
    """Those that concern some runs."""
    said = [FITTED] if any(published.compares_with(run) for run in runs) else []
    said += [EPSILON]
    return said + ([SAME_RULE] if any(map(_same_rule, runs)) else [])


def _same_rule(run: Run) -> bool:
    rules = {"paper", "nearest"} <= set(run.settings.caregivers)
    return rules and run.settings.plans[0].damage == DamageWeights() and not run.several
