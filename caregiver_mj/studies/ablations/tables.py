"""The tables of the ablations, printed row by row as they are worked out."""

from __future__ import annotations

from typing import Any

import numpy as np

from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.experiments.intervals import of_ratio
from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.studies.ablations.study import PRIORS, Figures, Study, Variant, paper, variants
from caregiver_mj.studies.documents import table_head, table_row

_FEW_EPSILONS = (1.0, 0.5, 0.05)
_THRESHOLDS = (0.0, 0.1, 0.5, 1.0)
_MIDDLE = 0.5  # the threshold at which priors are compared
_TIMES = (10, 50, 200)  # timesteps after which P(safe) is told


def print_variants(study: Study, alone: dict[float, Figures]) -> None:
    """Damage left under every variant, and whether it changes any episode at all."""
    left = (f"left at {epsilon:g}" for epsilon in EPSILONS)
    print(table_head("variant", *left, "toys kept", "interventions", "episodes as default"))
    default: dict[float, Figures] = {}
    for name, variant in variants().items():
        found = {epsilon: study.run(epsilon, variant) for epsilon in EPSILONS}
        default = default or found
        same = np.mean([_same(found[e], default[e]) for e in EPSILONS])
        toys, toys_alone = (sum(world[e]["toys_reached"].mean() for e in EPSILONS) for world in (found, alone))
        begun = np.mean([found[e]["interventions"].mean() for e in EPSILONS])
        left = (_damage_left(found[e], alone[e]) for e in EPSILONS)
        print(table_row(name, *left, f"{toys / toys_alone:.1%}", f"{begun:.1f}", f"{same:.0%}"), flush=True)


def print_thresholds(study: Study, alone: dict[float, Figures]) -> None:
    """What the prior does once expected danger is compared with a threshold."""
    rows: dict[str, dict[str, Any]] = {
        f"threshold {threshold:g}": {"threshold": threshold} for threshold in _THRESHOLDS
    }
    for name, options in PRIORS.items():
        if options:
            rows[f"threshold {_MIDDLE:g}, {name}"] = {"threshold": _MIDDLE, **options}
    print(table_head("variant", *(f"{what} at {e:g}" for what in ("left", "interventions") for e in _FEW_EPSILONS)))
    for name, options in rows.items():
        found = {epsilon: study.run(epsilon, Variant(paper(**options))) for epsilon in _FEW_EPSILONS}
        left = (_damage_left(found[e], alone[e]) for e in _FEW_EPSILONS)
        print(table_row(name, *left, *(f"{found[e]['interventions'].mean():.1f}" for e in found)), flush=True)


def print_safety(study: Study) -> None:
    """P(safe) of careful and careless novices, and how well it tells them apart."""
    columns = (f"{epsilon:g} after {timestep}" for epsilon in _FEW_EPSILONS for timestep in _TIMES)
    print(table_head("prior", *columns, f"told apart after {_TIMES[0]}"))
    careless, *_, careful = _FEW_EPSILONS
    for name, options in PRIORS.items():
        caregiver = PaperCaregiver(study.plan, **options)
        safe = {epsilon: study.safety(epsilon, caregiver, _TIMES) for epsilon in _FEW_EPSILONS}
        means = (f"{mean:.2f}" for epsilon in safe for mean in safe[epsilon].mean(axis=1))
        # The probability that a careful novice looks safer than a careless one, whichever two one takes.
        one, other = safe[careful][0][:, None], safe[careless][0]
        apart = (one > other).mean() + (one == other).mean() / 2
        print(table_row(name, *means, f"{apart:.2f}"), flush=True)


def _damage_left(assisted: Figures, alone: Figures) -> str:
    ratio, low, high = of_ratio(assisted["damage"], alone["damage"])
    return f"{ratio:.3f} ± {(high - low) / 2:.3f}"


def _same(one: Figures, other: Figures) -> np.ndarray:
    """Whether every figure of an episode is the same, (B,)."""
    return np.all([one[name] == other[name] for name in one], axis=0)
