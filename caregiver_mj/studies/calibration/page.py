"""The text of docs/calibration.md."""

from __future__ import annotations

from collections.abc import Iterable

import pandas as pd

from caregiver_mj.children.toddler import SHARE_OF_TIME_WALKING
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.studies.calibration.children import TOGETHER, families, title
from caregiver_mj.studies.calibration.scores import Scores
from caregiver_mj.studies.calibration.tally import HARMLESS, HORIZONS, SAFE
from caregiver_mj.studies.documents import table

_LONGEST = HORIZONS[-1]
_KINDS = {
    "stairwell": "a stairwell",
    "candle": "a table with a candle",
    "table": "a bare table",
    "any stairwell": "any stairwell",
    "any candle": "any table with a candle",
    "anything": "anything",
}

_PAGE = """\
# Does what foresight believes come true?

`foresight` believes something of a child: which toy bin it is going to and what share of its moves is random, as far
as its moves so far tell. From that follows how probable it is that the child bumps into each stairwell and each table
within the next 1, 5 and 15 timesteps (the first passage, with {change:.1%} a timestep that epsilon changes, as the
caregiver has it). Here that is held against what happened: {episodes:,} episodes of each child in each of {houses}
generated houses that nothing was fitted to (`{names}`), in the grid, with nobody to protect it. All of this page is
printed by

    {command}

A prediction is made before every move, of every object that the child could bump into in that time (what is farther
away than that is no prediction). It uses nothing that is seen later. Brackets are 95 % intervals with the house as
the unit of chance.

![Predicted against observed collisions, a panel for each child](calibration.png)

Collisions with any one object: of all predictions in a bin the mean, and how often they came true, on logarithmic
scales. On the line they are the same. A point on the lower edge never came true, or less often than that; bins of
fewer than {fewest} predictions are left out, and so are intervals that the houses do not bound.

## Where it is right

The belief begins with five epsilons, each as probable. Of children as it imagines them, five novices of these
epsilons together, what it says is what happens: {together_bias} times as many collisions are predicted as happen
within {longest} timesteps, and the calibration error is {together_error:.2%}. That holds for each kind of thing:

{kinds}

*Happened* is the share of predictions that came true, *predicted* their mean. The *skill* is 1 less the mean squared
error (Brier score) over that of somebody who knows how often this child bumps into things and nothing else: 1 is at
best, and below 0 it would be better to say the same all the time. The *calibration error* is the mean distance of
points from the line, each bin counted by its predictions.

## Where it is wrong

- **One child at a time** is not the mixture. Before it has seen many moves the belief takes a careful child for less
  careful than it is, and a careless one for less careless. Predicted over happened is {novice_1} of `novice 1`,
  {novice_quarter} of `novice 0.25` and {novice_least} of `novice 0.05`, the most careful one that it knows. Within
  one timestep all depends on epsilon, so that there its predictions of one novice have no skill: they differ only by
  how sure it is of a number that is the same all the time. Novices between its epsilons are no worse than those
  beside them.
- **`expert`** never bumps into anything; within {longest} timesteps {expert:.1%} was predicted of each object near
  it. The belief has no epsilon below 0.05.
- **`toddler`** is thought to bump into things {toddler_low} times as often as it does at epsilon 0.75, and
  {toddler_high} times at 0.25. It walks {walking:.0%} of the time only, in bouts, and the belief, which learns
  nothing from a rest, takes every timestep for a move.
- **`explorer`** does not know the house. Of the careful one (0.25) too few collisions are predicted, {explorer} times
  as many as happen, and at other places: what is thought to be improbable (below 1 %) happens several
  times as often, for its ways lead through furniture that it has not met; and what is thought to be probable
  happens less often, for what it has met it goes round.
- **`seeker`** goes to the robot, not to toys. The belief takes that for random moves, and predicts {seeker} times the
  collisions of the careful one (0.25).
- **`adversary`** does so with all its moves, and walks round everything but the robot: {adversary:.1%} predicted
  within {longest} timesteps of each object near it, none happened.
- **`avoider`** is predicted as well as a novice as long as the robot stands still.

Except for the explorer, and a little for the most random novice, the errors are to the safe side. The last three are
watched beside a robot that stands still where it was at first; without one, seeker and avoider are novices, and the
adversary walks north for ever.

{tables}

## What the paper's P(safe|tau) says

P(safe|tau) is drawn in films and weighs children against one another. It is the probability that a child moves as
experts do, and not at random. How often the next {longest} timesteps are harmless (no fall, no bump into any table)
is something else:

![Stated probability of a harmless stretch against its frequency](calibration_safe.png)

Of all the timesteps of the five novices together it is {safe_mean:.2f} on average, while {harmless:.0%} of the
stretches that follow are harmless. It tells careful children from careless ones, and is soon close to 0 or 1; for any
one child the line is flat: when it is high the next {longest} timesteps are as harmful as when it is low, for it does
not look at what is near. The belief's own probability of a harmless stretch lies on the line for children as it
imagines them.

{safe}
"""


def page(rows: pd.DataFrame, names: str, episodes: int, change: float, fewest: int, command: str) -> str:
    """Writes the page.

    Args:
        rows: Tallies of all houses.
        names: What the houses were asked for as.
        episodes: How many of each child in each house.
        change: Probability, in a timestep, that an epsilon is thought to change.
        fewest: Predictions in a bin that is drawn.
        command: What printed it.
    """

    def bias(family: str) -> str:
        return _interval(Scores.of(rows, family, _LONGEST).bias(), 2)

    def mean(family: str) -> float:
        return Scores.of(rows, family, _LONGEST).mean

    together = Scores.of(rows, TOGETHER, _LONGEST)
    harmless, safe = (Scores.of(rows, TOGETHER, _LONGEST, (kind,)) for kind in (HARMLESS, SAFE))
    return _PAGE.format(
        change=change,
        episodes=episodes,
        houses=rows.house.nunique(),
        names=names,
        command=command,
        fewest=fewest,
        longest=_LONGEST,
        together_bias=bias(TOGETHER),
        together_error=together.calibration_error,
        kinds=_kinds(rows),
        novice_1=bias("1"),
        novice_quarter=bias("0.25"),
        novice_least=bias("0.05"),
        expert=mean("expert:0"),
        toddler_low=bias("toddler:0.75"),
        toddler_high=bias("toddler:0.25"),
        walking=SHARE_OF_TIME_WALKING,
        explorer=bias("explorer:0.25"),
        seeker=bias("seeker:0.25"),
        adversary=mean("adversary:0"),
        tables="\n\n".join(_children(rows, horizon) for horizon in reversed(HORIZONS)),
        safe_mean=safe.mean,
        harmless=harmless.base_rate,
        safe=_safe(rows),
    )


def _kinds(rows: pd.DataFrame) -> str:
    found = [
        [what, str(horizon), *_figures(Scores.of(rows, TOGETHER, horizon, (kind,)))]
        for kind, what in _KINDS.items()
        for horizon in HORIZONS
    ]
    return table(["five novices together bump into", "within", *_TITLES], found)


def _children(rows: pd.DataFrame, horizon: int) -> str:
    found = [[title(family), *_figures(Scores.of(rows, family, horizon))] for family in (TOGETHER, *families())]
    within = f"{horizon} timestep" + "s" * (horizon != 1)
    return f"Any one object within {within}:\n\n{table(['child', *_TITLES], found)}"


_TITLES = ("happened", "predicted", "predicted over happened", "Brier score", "skill", "calibration error")


def _figures(scores: Scores) -> Iterable[str]:
    if not scores.count.any():
        return ["–"] * len(_TITLES)
    return (
        f"{scores.base_rate:.2%}",
        f"{scores.mean:.2%}",
        _interval(scores.bias(), 2),
        f"{scores.brier:.4f}",
        _interval(scores.skill(), 3),
        f"{scores.calibration_error:.2%}",
    )


def _safe(rows: pd.DataFrame) -> str:
    found = []
    for family in (TOGETHER, *families()):
        belief, safe = (Scores.of(rows, family, _LONGEST, (kind,)) for kind in (HARMLESS, SAFE))
        told = (f"{belief.base_rate:.1%}", f"{belief.mean:.1%}", _interval(belief.skill(), 2))
        found.append([title(family), *told, f"{safe.mean:.1%}", _interval(safe.skill(), 2)])
    titles = ("child", "harmless", "the belief says", "its skill", "P(safe) says", "its skill")
    return f"Harmless stretches of {_LONGEST} timesteps:\n\n{table(titles, found)}"


def _interval(estimate: Estimate[float], digits: int) -> str:
    """An estimate with the ends of its interval; a dash where there is none."""
    value, low, high = (f"{number:.{digits}f}" for number in estimate)
    return "–" if value == "nan" else f"{value} ({low} to {high})"
