"""The page docs/generalisation.md."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.foresight.foresight import CHANGE
from caregiver_mj.experiments import intervals, two_level
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.studies.documents import fill, table
from caregiver_mj.studies.generalisation.measure import (
    ALIKE,
    CHANGES,
    CHILDREN,
    FAMILIES,
    KNOWS,
    NONE,
    RULE,
    Damages,
    Found,
    foresight,
)
from caregiver_mj.studies.generalisation.priors import (
    ELSEWHERE,
    HORIZON,
    HOW,
    IN_PLACE,
    MEASURES,
    NOBODY,
    PRIORS,
    WHOSE,
)


def page(found: Sequence[Found], houses: str, learnt_in: str, command: str) -> str:
    """The text of the page, which a command prints."""
    intro = fill(
        f"Every number is a mean over the {len(found)} houses of `{houses}`, in the grid, with the 95 % interval that "
        "has the house as unit of chance. The same children throughout. All of this page is printed by"
    )
    return f"""# Generalisation

{intro}

    {command}

![P(safe) by whose routes were learnt, what it is worth, and children that change](generalisation.png)

## Experts of other houses

{_experts(learnt_in)}

{_telling(found)}

Less that with experts in place:

{_telling_differences(found)}

### What that is worth

{_worth_intro()}

{_two(found)}

## Children that change

{_changing_intro()}

{_changing(found)}

Damage an episode with `foresight` less that with its default, change {CHANGE:g}, in the same episodes:

{_changing_differences(found)}
"""


def _experts(learnt_in: str) -> str:
    first = fill(
        "The paper's action prior counts what experts do in every cell of the house. *Elsewhere* has the same experts, "
        f"1,000 timesteps in each house of `{learnt_in}`; what they did is counted by what "
        "stands in the four neighbouring cells and by where the bin lies (`danger/local_prior.py` has the formulae). "
        "*Nobody* is the hyperprior alone: its mean is uniform, P(safe) stays at .5, and any of its draws is noise. "
        "The rule takes a draw."
    )
    second = fill(
        "Novices of all five epsilons walk alone. P(safe|tau) after each timestep is taken as a forecast: that epsilon "
        f"is below .5 and not above (those of .5 are left out), and that there is no collision in the next {HORIZON} "
        "timesteps. *AUC*: how often the safe one of two has the higher P(safe), .5 being chance. *Brier*: mean "
        "squared error of P(safe), .25 for a constant .5. *Log likelihood*: of the moves on new experts' routes in the "
        "house, nats a move; uniform moves have -1.386. Houses in which nothing is to be told apart are left out."
    )
    return f"{first}\n\n{second}"


def _telling(found: Sequence[Found]) -> str:
    rows = []
    for whose, how in PRIORS:
        rows.append((whose, how, *(_interval(_over(values)) for values in _values(found, whose, how))))
    return table(("experts", "theta", *MEASURES.values()), rows)


def _telling_differences(found: Sequence[Found]) -> str:
    rows = []
    for how in HOW:
        for whose in (ELSEWHERE, NOBODY):
            pairs = zip(_values(found, whose, how), _values(found, IN_PLACE, how), strict=True)
            rows.append((whose, how, *(_interval(_over(ours - theirs), "+") for ours, theirs in pairs)))
    return table(("experts", "theta", *MEASURES.values()), rows)


def _worth_intro() -> str:
    return fill(
        "With one child 1 - P(safe) cancels, so the prior changes nothing. With two it says whom to attend to. Damage "
        "of the rule to both, as a share of that without a caregiver, and less that of the same rule without the "
        "factor (`paper-alike`): below 0 the factor helps."
    )


def _two(found: Sequence[Found]) -> str:
    rows = []
    for i, family in enumerate(FAMILIES):
        alone, alike = (_column(found, NONE, i, "two"), _column(found, ALIKE, i, "two"))
        for name in (*WHOSE, ALIKE):
            ours = _column(found, name, i, "two")
            left = _interval(two_level.of_ratio(ours, alone))
            told = ("–", "–") if name == ALIKE else _difference(two_level.of_difference(ours, alike))
            rows.append((family, f"`{ALIKE}`" if name == ALIKE else name, left, *told))
        carried, own = (_column(found, name, i, "two") for name in (ELSEWHERE, IN_PLACE))
        rows.append((family, "elsewhere, less in place", "–", *_difference(two_level.of_difference(carried, own))))
    return table(("children", "experts", "left", "difference", "verdict"), rows)


def _changing_intro() -> str:
    return fill(
        "`drifter:0.4` grows careless, from epsilon .05 to .75; `waverer:0.4` begins at .4 and goes up and down at "
        "random; the toys of `switcher:0.25` are carried to the other half of the bins in mid-episode, and it turns "
        "round on its way. Beside them novices of the same epsilon that do not change. `foresight` believes that a "
        f"child's epsilon is drawn anew with a probability, *change*, in each timestep ({CHANGE:g} by default), and "
        "that a bin is kept until it is reached, every one being as probable as the next. `knows-goal` is the same "
        "planner, told the bin and the epsilon of the moment. Share of the damage that is left:"
    )


def _changing(found: Sequence[Found]) -> str:
    rows = []
    for name in (RULE, *map(foresight, CHANGES), KNOWS):
        cells = (
            _interval(two_level.of_ratio(_column(found, name, i), _column(found, NONE, i)))
            for i in range(len(CHILDREN))
        )
        rows.append((f"`{name}`", *cells))
    alone = np.mean([one.changing[NONE].mean(axis=0) for one in found], axis=0)
    rows.append(("*damage alone*", *(f"{damage:.1f}" for damage in alone)))
    return table(("caregiver", *(f"`{child}`" for child in CHILDREN)), rows)


def _changing_differences(found: Sequence[Found]) -> str:
    rows = []
    for name in (RULE, *(foresight(change) for change in CHANGES if change != CHANGE), KNOWS):
        each = []
        for i in range(len(CHILDREN)):
            value, verdict = _difference(
                two_level.of_difference(_column(found, name, i), _column(found, foresight(CHANGE), i))
            )
            each.append(value if verdict == _UNSEEN else f"**{value}**")
        rows.append((f"`{name}`", *each))
    return f"""{table(("caregiver", *(f"`{child}`" for child in CHILDREN)), rows)}

Bold: the interval leaves out zero. Nothing is corrected for the number of comparisons."""


# -- Numbers -----------------------------------------------------------------------------------------

_UNSEEN = "no difference seen"


def _values(found: Sequence[Found], whose: str, how: str) -> np.ndarray:
    """Each of `MEASURES` in every house, (measures, houses)."""
    return np.array([one.telling[whose, how].measures for one in found]).T


def _over(values: np.ndarray) -> Estimate[float]:
    """The mean over those houses that have a value."""
    return intervals.of_mean(values[~np.isnan(values)])


def _column(found: Sequence[Found], name: str, number: int, part: str = "changing") -> list[np.ndarray]:
    """Damage in every episode of each house, of one caregiver with one family."""
    damages: list[Damages] = [getattr(one, part) for one in found]
    return [damage[name][:, number] for damage in damages]


def _difference(estimate: Estimate[float]) -> tuple[str, str]:
    """A difference of damage, and what it says."""
    verdict = "less damage" if estimate.high < 0 else "more damage" if estimate.low > 0 else _UNSEEN
    return _interval(estimate, "+"), verdict


def _interval(estimate: Estimate[float], sign: str = "") -> str:
    mean, low, high = (f"{round(value, 3) + 0.0:{sign}.3f}" for value in estimate)  # + 0.0: no -0.000
    return mean if low == high else f"{mean} ({low} to {high})"
