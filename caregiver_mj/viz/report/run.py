"""A finished run as the report needs it, and the paper's numbers beside it."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import os
import re
import shlex
from collections.abc import Sequence
from typing import Any

import numpy as np

from caregiver_mj.caregivers.registry import RULE
from caregiver_mj.children.walk import WALKING_SPEED
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.finished import Finished, read_finished
from caregiver_mj.experiments.spec import BARE_TABLES, Conditions
from caregiver_mj.plans.floor_plan import FloorPlan, house_names
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.plans.sets import is_generated
from caregiver_mj.viz.report import words

PAPER = 'Rosman, Hayes and Scassellati, "Enhancing Agent Safety through Autonomous Environment Adaptation", 2015'
# Its Tables I and II: means of 20 episodes without and with the caregiver, by the share of the novice's moves that are
# random. Damage is normalised by the greatest of any episode.
PUBLISHED = {
    "damage_normalised": {
        1.0: (0.7346, 0.2291), 0.75: (0.5295, 0.1438), 0.5: (0.2846, 0.1106),
        0.25: (0.1887, 0.0466), 0.05: (0.0565, 0.0072),
    },
    "timesteps_to_threshold": {
        1.0: (35.50, 97.05), 0.75: (41.05, 164.20), 0.5: (89.50, 171.50),
        0.25: (107.70, 200.00), 0.05: (195.75, 200.00),
    },
}  # fmt: skip
_WORLDS = {"grid": "Grid", "house": "Physical house"}
_CONDITIONS = ("embodiment", "sight", "child_speed")  # options of a run beside those that it always has
_LONGEST = 40  # characters of the houses' names in titles and file names


@dataclasses.dataclass(frozen=True)
class Run(Finished):
    """A finished run to report on, with `none` and a caregiver that acts."""

    caregiver: str  #: the caregiver to report on, beside the others

    @functools.cached_property
    def families(self) -> tuple[str, ...]:
        """The families as text, such as "0.5" or "1,0.25"."""
        return tuple(map(str, self.settings.families))

    @property
    def houses(self) -> int:
        """Number of houses."""
        return len(self.settings.plans)

    @property
    def rank(self) -> int:
        """Place on a page: test houses first, then training houses, a single house, and `paper` last."""
        if self.houses > 1:
            return int(re.match("(shapes-|home-)?train-", self.settings.houses) is not None)
        return 3 if self.settings.plan.name == "paper" else 2

    @property
    def name(self) -> str:
        """Name in file names."""
        world, place = self.settings.world, re.sub(r"[^\w.-]+", "-", self.settings.place)[:_LONGEST]
        return world if place == "paper" else f"{world}_{place}"

    @property
    def title(self) -> str:
        world, place = _WORLDS[self.settings.world], self.settings.place
        if self.settings.sight != "all":
            world += f", sight {self.settings.sight}"
        if self.settings.child_speed != WALKING_SPEED:
            world += f", children at {self.settings.child_speed:g} m/s"
        if self.houses > 1:
            return f"{world}, {self.houses} houses" + (f" ({place})" if len(place) <= _LONGEST else "")
        return f"{world} ({place})"

    @property
    def several(self) -> bool:
        """Whether a family has more than one child."""
        return any(len(words.members(family)) > 1 for family in self.families)

    @property
    def nouns(self) -> dict[str, str]:
        """Nouns for its children."""
        return words.SEVERAL if self.several else words.SINGLE

    @property
    def baselines(self) -> tuple[str, ...]:
        """The other caregivers that act."""
        return tuple(c for c in self.acting if c != self.caregiver)

    @property
    def acting(self) -> tuple[str, ...]:
        """All caregivers that act, in the run's order."""
        return tuple(c for c in self.settings.caregivers if c not in ("none", BARE_TABLES))

    @property
    def bare_tables(self) -> tuple[str, ...]:
        """The name of the bare-tables baseline, if the run has it."""
        return tuple(c for c in self.settings.caregivers if c == BARE_TABLES)

    def row(self, caregiver: str, family: str) -> dict[str, Any]:
        """Return the summary's row of a caregiver and a family."""
        return next(r for r in self.summary["rows"] if (r["caregiver"], r["family"]) == (caregiver, family))

    def comparison(self, caregiver: str, family: str, baseline: str = "none") -> dict[str, Any]:
        """Return the summary's comparison of two caregivers with a family; empty for a family of another run."""
        wanted = (caregiver, baseline, family)
        rows = self.summary["comparisons"]
        return next((r for r in rows if (r["caregiver"], r["baseline"], r["family"]) == wanted), {})

    def mean(self, caregiver: str, column: str) -> float:
        """Return the mean over all episodes of all families."""
        return float(self.episodes.loc[self.episodes.caregiver == caregiver, column].mean())

    def command(self) -> str:
        """Return the command that reproduces the rows; several for pooled runs."""
        settings, asked = self.settings, [_asked_house(plan) for plan in self.settings.plans]
        command = ["caregiver-mj", "evaluate", "--world", settings.world]
        if self.houses == 1:
            command += ["--house", settings.file or asked[0]]
        else:
            command += ["--houses", *(shlex.split(settings.houses) or asked)]
        ours, usual = (
            {"damage": damage, **{name: getattr(run, name) for name in _CONDITIONS}, **run.queries.record()}
            for damage, run in ((settings.plans[0].damage, settings), (DamageWeights(), Conditions()))
        )
        for name, value in ours.items():
            if value != usual[name]:
                command += [f"--{name.replace('_', '-')}", *([] if value is True else [str(value)])]
        command += ["--caregiver", *settings.caregivers, "--epsilon", *self.families]
        more = f"  # and task_kwargs={settings.options}, from Python" if settings.options else ""
        return "\n".join(
            shlex.join([*command, "--episodes", str(episodes), "--seed", str(seed)]) + more
            for seed, episodes in self.seeds
        )

    def cells(self, caregiver: str, key: str, digits: int = 1, scale: float = 1.0, against: bool = False) -> list[str]:
        """Return a number of a caregiver's rows, or of those against none, with its interval: one for each family."""
        of = self.comparison if against else self.row
        rows = (of(caregiver, family) for family in self.families)
        return [words.with_interval(row, key, digits, between="\n", scale=scale) for row in rows]

    def table(self, what: str, first: str, rows: Sequence[tuple[str, ...]], note: str = "") -> words.Table:
        """Return a table with a column for each family, beside the first one."""
        return words.Table(f"{what} — {self.title}", (first, *map(words.family_name, self.families)), rows, note)

    # -- The paper's numbers ---------------------------------------------------------------------

    @functools.cached_property
    def cited(self) -> bool:
        """Whether the paper's numbers are comparable.

        They are of one novice at the paper's speed, an unpublished house, and the rule with full sight. Only house
        `paper` stands in for that house.
        """
        settings = self.settings
        its_own = settings.plans == (FloorPlan.load("paper"),) and settings.sight == "all"
        its_own &= settings.child_speed == WALKING_SPEED and self.caregiver in RULE
        return its_own and any(len(words.members(family)) == 1 for family in self.families)

    def published(self, column: str, family: str) -> tuple[float, float] | None:
        """Return the paper's means without and with the caregiver, or None if it has none for these children."""
        only, *others = words.members(family)
        return None if others or only[0] or not self.cited else PUBLISHED.get(column, {}).get(only[1])

    def published_series(self, column: str, families: Sequence[str], guarded: bool) -> np.ndarray:
        """Return the paper's means for several families, NaN for unknown ones, (families,)."""
        return np.array([(self.published(column, family) or (np.nan, np.nan))[guarded] for family in families])

    def published_avoided(self) -> str | None:
        """Return the paper's share of damage avoided over all novices, or None if it lacks one of them."""
        alone, guarded = (self.published_series("damage_normalised", self.families, who).sum() for who in (False, True))
        return f"{100 * (1 - guarded / alone):.0f} %" if np.isfinite(alone) else None

    def deviations(self) -> dict[str, list[dict[str, Any]]]:
        """Return the rows of the paper's Tables I and II: our mean, its 95 % interval, the paper's, and the deviation.

        There is a row for each share of random moves, without and with the caregiver; for damage also for the share
        left.
        """
        found: dict[str, list[dict[str, Any]]] = {column: [] for column in PUBLISHED}
        for family, column in itertools.product(self.families, PUBLISHED):
            if (cited := self.published(column, family)) is None:
                continue
            quantities = [
                (which, self.row(caregiver, family), column, paper)
                for which, caregiver, paper in zip(("without", "with"), ("none", self.caregiver), cited, strict=True)
            ]
            if column == "damage_normalised":
                left_here = self.comparison(self.caregiver, family)
                quantities.append(("left", left_here, "damage_left", cited[1] / cited[0]))
            for which, row, key, paper in quantities:
                ours = row[key if key in row else f"{key}_mean"]
                interval = {end: row[f"{key}_ci_{end}"] for end in ("low", "high")}
                cells = {"epsilon": family, "quantity": which, "here": ours, **interval, "paper": paper}
                found[column].append(cells | {"deviation": None if ours is None else ours - paper})
        return found


def _asked_house(plan: FloorPlan) -> str:
    """Return the name of a house for the command line, or that of a file if the name gives another house.

    Generated houses are not made for this, which may take seconds each.
    """
    if plan.name in house_names():
        return plan.name if FloorPlan.load(plan.name).rows == plan.rows else f"{plan.name}.txt"
    return plan.name if is_generated(plan.name) else f"{plan.name}.txt"


def read_run(folder: str | os.PathLike[str], caregiver: str = "") -> Run:
    """Read a finished run, to report on a caregiver; "" for the paper's rule, or the first one that acts without it.

    Raises:
        CaregiverError: The folder has none, or one without `none`, the caregiver or any that acts.
    """
    run = Run(**vars(read_finished(folder)), caregiver=caregiver)
    caregivers = run.settings.caregivers
    if not run.acting or "none" not in caregivers:
        raise CaregiverError(
            f"a report must be of `none` and a caregiver that acts, got only {' and '.join(caregivers)} in '{folder}': "
            "add what it lacks with `caregiver-mj evaluate --resume`"
        )
    if caregiver and caregiver not in run.acting:
        raise CaregiverError(f"the caregiver to report on must be in '{folder}', which has {', '.join(run.acting)}")
    usual = next((name for name in RULE if name in run.acting), run.acting[0])
    return dataclasses.replace(run, caregiver=caregiver or usual)
