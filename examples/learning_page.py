"""Writes docs/learning.md and its figure from what the examples have trained and judged.

python examples/learning_page.py --targets runs/targets --stairs runs/block_stairs --docs docs
"""

from __future__ import annotations

import argparse
import pathlib
import textwrap
from collections.abc import Callable, Sequence

import matplotlib as mpl
import numpy as np
import pandas as pd
from judge_targets import RULE, SCRIPTED
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter

from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.statistics import Sample, pairs
from caregiver_mj.experiments.two_level import of_difference, of_ratio
from caregiver_mj.viz import colours
from caregiver_mj.viz.figure_style import INK, STYLE, as_bytes

PPO = "MaskablePPO"  # the mean over its seeds
_DAMAGE = ["damage"]
_SMOOTH = 2  # points of a curve that are shown as their mean
_SHADES = [colours.unit(colour) for colour in (colours.ROBOT, colours.BIN, colours.CANDLE, colours.STAIRWELL)]


def read_judged(folder: pathlib.Path) -> pd.DataFrame:
    """The episodes of those houses in which all were judged; those of `PPO` are means over its seeds."""
    parts = {name: {file.name: file for file in (folder / name).glob("*.parquet")} for name in ("scripted", "learnt")}
    files = [
        part[name] for name in sorted(parts["scripted"].keys() & parts["learnt"].keys()) for part in parts.values()
    ]
    rows = pd.concat(map(pd.read_parquet, files), ignore_index=True)
    seeds = rows[rows.caregiver.str.startswith("PPO, ")]
    keys = ["world", "house", "family", "epsilon", "episode"]
    mean = seeds.groupby(keys, as_index=False, sort=False)[["damage", "toys_reached"]].mean().assign(caregiver=PPO)
    return pd.concat([rows, mean], ignore_index=True)


def read_curves(folder: pathlib.Path) -> dict[str, pd.DataFrame]:
    """The curve of each seed."""
    return {file.name.split("-")[1]: pd.read_csv(file) for file in sorted(folder.glob("seed-*-curve.csv"))}


# -- The page ----------------------------------------------------------------------------------------


def page(rows: pd.DataFrame, targets: dict[str, pd.DataFrame], stairs: dict[str, pd.DataFrame], judged: pd.DataFrame):
    """The whole page.

    Args:
        rows: Episodes with trained and scripted caregivers.
        targets: How the target-level policies were trained, by seed.
        stairs: How those of `BlockStairs` were, by seed.
        judged: The episodes of these.
    """
    houses, episodes = rows.house.nunique(), rows.episode.nunique()
    steps, used = _spent(targets, "steps")
    decisions, of_stairs = _spent(stairs, "decisions")
    parts = [
        "# Policies that learn",
        fill(
            "How well do the examples learn on a CPU with Stable-Baselines3 and sb3-contrib (extra `learn`, "
            "[examples](../examples/README.md))?"
        ),
        f"    python examples/supervise_targets.py --steps {steps}\n"
        f"    python examples/judge_targets.py --houses test-{houses} --episodes {episodes}\n"
        f"    python examples/block_stairs.py --decisions {decisions}\n"
        "    python examples/learning_page.py --docs docs",
        "![Training curves of both examples, a line for each seed](learning.png)",
        fill(_said(rows)),
        "## Which hazard to protect from, in any house",
        fill(
            f"MaskablePPO is trained on targets in the grid, with {len(targets)} seeds of at least {steps:,} timesteps "
            f"({used} core-minutes) in `train-100`, with novices of epsilon .75, .5 and .25. For each hazard it "
            "observes distances, damage and whether it is held or under intervention, but neither walls nor bins; one "
            f"network scores every hazard in turn. Damage left in `test-{houses}`, {episodes} episodes of each novice, "
            f"with 95 % intervals over houses; `{RULE}` is the rule deciding once per timestep, as the policy does."
        ),
        _left(rows),
        fill(f"Damage of an episode, less that of others in the same episodes (*{PPO}* is the mean of its seeds):"),
        _differences(rows),
        "## Driving into a stairwell",
        fill(
            "PPO on `caregiver_mj/BlockStairs-v0` in house `paper` sets the velocity of the base every 20 control "
            f"steps (0.4 s). {len(stairs)} seeds of at least {decisions:,} decisions ({of_stairs} core-minutes), "
            f"evaluated deterministically in {judged.episode.nunique()} other episodes: mean reward per control step, "
            "± its standard deviation between episodes, and cost of an episode."
        ),
        _stairs(judged),
    ]
    return "\n\n".join(parts) + "\n"


def _spent(curves: dict[str, pd.DataFrame], what: str) -> tuple[int, str]:
    """How long the seeds were trained, the least of them, and the core-minutes of each on average."""
    least = min(int(curve[what].max()) for curve in curves.values())
    return least, f"{np.mean([curve.core_seconds.max() for curve in curves.values()]) / 60:.1f}"


def _left(rows: pd.DataFrame) -> str:
    seeds = sorted({name for name in rows.caregiver if name.startswith("PPO, ")})
    names = ["nearest", "paper", RULE, PPO, *SCRIPTED[3:]]
    lines = [(f"`{name}`", *_each(rows, name, "none", of_ratio, 2)) for name in names]
    spread = [
        f"{np.std([_value(rows, seed, family) for seed in seeds], ddof=1) / _value(rows, 'none', family):.3f}"
        for family in _families(rows)
    ]
    alone = [f"{_value(rows, 'none', family):.1f}" for family in _families(rows)]
    lines += [("*spread of the seeds (sd)*", *spread), ("*damage alone*", *alone)]
    return table(("caregiver", *_titles(rows)), lines)


def _differences(rows: pd.DataFrame) -> str:
    others = ("paper", "foresight")
    lines = [(f"`{other}`", *_each(rows, PPO, other, of_difference, 2, "+")) for other in others]
    return table((f"{PPO}, less", *_titles(rows)), lines)


def _said(rows: pd.DataFrame) -> str:
    """What the differences from the rule and from foresight say."""
    said = []
    for other in ("paper", "foresight"):
        verdicts: dict[str, list[str]] = {"less": [], "more": [], "neither detectably less nor more": []}
        for family, estimate in _estimates(rows, PPO, other, of_difference).items():
            word = "less" if estimate.high < 0 else "more" if estimate.low > 0 else "neither detectably less nor more"
            verdicts[word].append(f"{100 * float(family):g} %")
        parts = [f"{word} damage at {', '.join(cells)} random" for word, cells in verdicts.items() if cells]
        said.append(f"Compared with `{other}`, {PPO} leaves {'; '.join(parts)}.")
    return " ".join(said) + " These comparisons are not corrected for their number."


def _stairs(judged: pd.DataFrame) -> str:
    lines = [
        (who, f"{rows.reward.mean():.2f} ± {rows.reward.std():.2f}", f"{rows.cost.mean():.2f}")
        for who, rows in judged.groupby("who", sort=False)
    ]
    means = judged[judged.who.str.startswith("PPO")].groupby("who").reward.mean()
    lines.insert(len(means), ("*mean of the seeds, ± their sd*", f"{means.mean():.2f} ± {means.std():.2f}", ""))
    return table(("policy", "mean reward", "cost"), lines)


def fill(text: str) -> str:
    """A paragraph in lines."""
    return textwrap.fill(text, 120, break_long_words=False, break_on_hyphens=False)


def table(titles: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown, whose first column is text and whose others are figures."""
    lines = [titles, ["---", *["---:"] * (len(titles) - 1)], *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


# -- Numbers -----------------------------------------------------------------------------------------


def _families(rows: pd.DataFrame) -> list[str]:
    return list(dict.fromkeys(rows.family))


def _titles(rows: pd.DataFrame) -> list[str]:
    return [f"{100 * float(family):g} % random" for family in _families(rows)]


def _value(rows: pd.DataFrame, name: str, family: str) -> float:
    """Mean damage over houses."""
    return float(rows[(rows.caregiver == name) & (rows.family == family)].groupby("house").damage.mean().mean())


def _estimates(rows: pd.DataFrame, ours: str, theirs: str, how: Callable[..., Estimate]) -> dict[str, Estimate]:
    def damage(sample: Sample) -> list[np.ndarray]:
        return [house[:, 0] for house in sample.values(_DAMAGE)]

    return {str(key["family"]): how(damage(one), damage(other)) for key, one, other in pairs(rows, ours, theirs)}


def _each(rows: pd.DataFrame, ours: str, theirs: str, how, digits: int, sign: str = "") -> list[str]:
    found = _estimates(rows, ours, theirs, how)
    cells = []
    for family in _families(rows):
        value, low, high = (f"{round(float(end), digits) + 0.0:{sign}.{digits}f}" for end in found[family])
        cells.append(f"{value} ({low} to {high})")
    return cells


# -- The figure --------------------------------------------------------------------------------------


def draw(targets: dict[str, pd.DataFrame], stairs: dict[str, pd.DataFrame], judged: pd.DataFrame) -> Figure:
    """Damage left over timesteps, and reward over decisions, a line a seed."""
    with mpl.rc_context(STYLE):
        figure = Figure((9.0, 3.3), layout="constrained")
        left, right = figure.subplots(1, 2)
        for i, (seed, curve) in enumerate(targets.items()):
            mean = (
                curve.damage.rolling(_SMOOTH, min_periods=1).sum() / curve.alone.rolling(_SMOOTH, min_periods=1).sum()
            )
            _line(left, curve.steps, mean, seed, i)
        left.set_title(f"target level: damage left in training, mean of {_SMOOTH} batches", fontsize=10)
        left.set_xlabel("timesteps")
        for i, (seed, curve) in enumerate(stairs.items()):
            means = curve.groupby("decisions").reward.mean()
            _line(right, means.index, means, seed, i)
        for who, style in (("scripted", "--"), ("stands still", ":")):
            mean = judged[judged.who == who].reward.mean()
            right.axhline(mean, color=INK, linewidth=1, linestyle=style, label=who)
        right.set_title("BlockStairs: mean reward of episodes in training", fontsize=10)
        right.set_xlabel("decisions")
        for axes in (left, right):
            axes.set_ylim(0, 1.05)
            axes.xaxis.set_major_formatter(EngFormatter(sep=""))
            axes.legend(fontsize=8)
    return figure


def _line(axes: Axes, x: Sequence[float], y: Sequence[float], seed: str, i: int) -> None:
    axes.plot(np.asarray(x), np.asarray(y), color=_SHADES[i % len(_SHADES)], linewidth=1.4, label=f"seed {seed}")


def main() -> None:
    """Writes the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--targets", type=pathlib.Path, default=pathlib.Path("runs/targets"), metavar="DIR")
    parser.add_argument("--stairs", type=pathlib.Path, default=pathlib.Path("runs/block_stairs"), metavar="DIR")
    parser.add_argument("--docs", type=pathlib.Path, metavar="DIR", help="write the page and its figure there")
    options = parser.parse_args()
    for folder, pattern, first in (
        (options.targets, "seed-*-curve.csv", "supervise_targets.py"),
        (options.targets, "scripted/*.parquet", "judge_targets.py"),
        (options.targets, "learnt/*.parquet", "judge_targets.py"),
        (options.stairs, "seed-*-curve.csv", "block_stairs.py"),
        (options.stairs, "*-judged.csv", "block_stairs.py"),
    ):
        if not any(folder.glob(pattern)):
            raise SystemExit(f"there is no {folder / pattern}: run {pathlib.Path(__file__).with_name(first)} first")
    judged = pd.concat(map(pd.read_csv, sorted(options.stairs.glob("*-judged.csv"))), ignore_index=True)
    judged = judged.sort_values("who", kind="stable", ignore_index=True)
    targets, stairs = read_curves(options.targets), read_curves(options.stairs)
    text = page(read_judged(options.targets), targets, stairs, judged)
    print(text, end="")
    if options.docs:
        options.docs.mkdir(parents=True, exist_ok=True)
        (options.docs / "learning.md").write_text(text, encoding="utf-8")
        (options.docs / "learning.png").write_bytes(as_bytes(draw(targets, stairs, judged), "png"))


if __name__ == "__main__":
    main()
