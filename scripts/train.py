"""Train the learned caregiver: DAgger, with `foresight` as the teacher, in the batched grid.

    python scripts/train.py --out runs/learned                  # 42 minutes on one core, 55 at most (--minutes)
    python scripts/train.py --out runs/learned --minutes 2      # to see it work
    python scripts/train.py --out runs/learned --resume
    python scripts/train.py --out runs/learned --judge          # beside the rule and foresight, in houses kept back
    python scripts/train.py --out runs/learned --judge runs/other --houses test-100    # another run too, elsewhere

Houses come in blocks, each house once. In the houses of a block the network of the blocks so far decides (in the first
block the paper's rule), with occasional random options. At a share of its decisions `foresight` labels each option with
its expected damage, at a slightly lower price of a denied move. Then the network is trained on all labels so far to
minimise the expected damage of the options that it draws. So it learns in the states that its own decisions lead to
(Ross, Gordon and Bagnell, AISTATS 2011), from the costs of decisions (Ross and Bagnell, arXiv 1406.5979).

DIR then has learned.npz, the weights; curve.csv and curve.svg; and the state for --resume: a file for each house, and
the weights after each block. The weights depend on seed and houses only, unless --minutes ends the training early; a
resumed run gives the same weights as an uninterrupted one.
"""

from __future__ import annotations

import os

if __name__ == "__main__":  # workers inherit it
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # more threads are no faster, and change rounding

import argparse
import collections
import concurrent.futures
import csv
import functools
import json
import math
import multiprocessing
import pathlib
import time
from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.foresight.foresight import ForesightCaregiver, each_on_a_table
from caregiver_mj.caregivers.foresight.options import Cases, Sums
from caregiver_mj.caregivers.foresight.value_table import candles_at_a_time
from caregiver_mj.caregivers.learned import OBJECTIVE, LearnedCaregiver, Weights, layers
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import bare_tables
from caregiver_mj.children.random_stream import RandomStream
from caregiver_mj.danger.child_model import EPSILONS
from caregiver_mj.errors import CaregiverError
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.plans.sets import houses_named

HOUSES = "train-100", "home-train-50", "shapes-train-25"
WEIGHTS = "learned.npz"
JUDGED = 12  # first houses, held out for validation
BLOCK = 8  # houses
HIDDEN = 64
STATES = 600_000  # greatest size of a house's tables (`_states`): larger ones take more than a minute each
EPISODES, PAIRS = 64, 16  # episodes in a house, with one child and with two
SHARE = 0.3  # of the decisions that the teacher labels
ASTRAY, BACK = 0.05, 0.3  # probabilities per timestep of starting and of ending a random option
BATCH, RATE, MOST = 512, 2e-3, 3.0  # decisions; step size; greatest regret of an option, in damage
LOOSE = 0.01  # weight of the entropy of the options, in damage
PASSES, LAST = 3, 12  # passes through all data after each block, and at the end
CAREGIVERS: dict[str, Callable[[FloorPlan], Caregiver | None]] = {
    "alone": lambda _: None,
    "rule": PaperCaregiver,
    "learned": LearnedCaregiver,
    "foresight": ForesightCaregiver,
}
_PARTS = "rows", "worlds", "counts", "damage"  # of labelled data: features, numbers of options, and damage
_KINDS = np.float32, np.float32, np.int64, np.float32
_BETA = 0.9, 0.999, 0.998  # decay of Adam's moments, and of the moving average of the weights


class Teacher(ForesightCaregiver):
    """Labels each option of the learner with its expected damage.

    Attributes:
        said: The damage, (B, options), infinite for impossible options.
    """

    said = np.empty(0)

    def _options(self, values, percept, worlds):
        every = np.arange(len(worlds))
        sums = Sums.zeros(values, values.motion, every, percept, worlds)
        for child, belief in enumerate(np.moveaxis(self.belief.probability[worlds], 1, 0)):
            wants = belief.reshape(len(worlds), -1)[:, values.possible].astype(np.float32)
            sums.add(Cases(every, percept.child_cell[worlds, child], wants))
        options, index = sums.options(), sums.index
        bare = bare_tables(percept.candle_table[worlds], len(self.plan.tables))
        pairs = np.full((*sums.got.shape, len(self.plan.tables)), np.inf)
        if sums.carried.size:
            gone = np.zeros(sums.lying.shape, bool) if percept.gone is None else percept.gone[worlds]
            left = (sums.lying * ~gone).sum(axis=1)[:, None, None]
            going = options.damage[:, index.relocations, None]
            found = np.where(sums.got[..., None], sums.carried.min(axis=3) + left, going)
            where = np.nonzero(bare)[1].reshape(len(worlds), 1, -1)
            np.put_along_axis(pairs, np.broadcast_to(where, found.shape), found, axis=2)
        others = options.damage[:, index.pick_ups], options.damage[:, [index.aside, index.stay]]
        pairs = pairs.reshape(len(worlds), -1)
        self.said[worlds] = np.column_stack([options.damage[:, index.stairs], pairs, *others])
        return options


class Learner(LearnedCaregiver):
    """The learner with its teacher, and with random options now and then.

    Attributes:
        heard: For each query of the teacher the features of options and worlds, the number of options in each world,
            and the damage.
    """

    def __init__(self, plan: FloorPlan, net: Weights | None, teacher: Teacher, random: np.random.Generator):
        self.net, self._teacher, self._random, self.heard = net, teacher, random, []
        self._rule = PaperCaregiver(plan)
        super().__init__(plan)

    def reset(self, batch, seeds=None, children=1):
        super().reset(batch, seeds, children)
        self._teacher.pace = self.pace
        self._rule.reset(batch, seeds, children)
        self._astray = np.full(batch, NOTHING)

    def watch(self, percept):
        super().watch(percept)
        self._rule.watch(percept)
        drawn = self._random.random((2, len(self._astray)))
        option = self._random.integers(len(self.hazard), size=len(self._astray))
        self._astray = np.where(drawn[0] < ASTRAY, option, np.where(drawn[1] < BACK, NOTHING, self._astray))

    def decide(self, percept):
        orders = super().decide(percept)
        if self.net is None:
            orders = self._rule.decide(percept)
        can_be = self.can_be(each_on_a_table(self.plan, percept))[np.arange(len(self._astray)), self._astray]
        return self.take(self._astray).where((self._astray != NOTHING) & can_be, orders)

    def scores(self, percept, worlds):
        options, world, there = self.features(percept, worlds)
        asked = self._random.random(len(worlds)) < SHARE
        if asked.any():
            self._ask(percept, worlds[asked], options[asked], world[asked], there[asked])
        return self.judged(options, world, there) if self.net else np.where(there, 0.0, -np.inf)

    def _ask(self, percept, worlds, options, world, there):
        self._teacher.belief = self.followers.belief
        self._teacher.said = np.full((len(self._astray), len(self.hazard)), np.inf)
        self._teacher.options(percept, worlds)
        said = self._teacher.said[worlds]
        there = there & (said < 1e6)
        some = there.sum(axis=1) > 1
        there &= some[:, None]
        parts = options[there], world[some], there.sum(axis=1)[some], said[there]
        self.heard.append(tuple(part.astype(kind) for part, kind in zip(parts, _KINDS, strict=True)))


def _states(plan: FloorPlan) -> int:
    """Return the number of states of cells and candles in foresight's tables, without goals; 0 for none."""
    candles = candles_at_a_time(plan)
    if candles < min(1, len(plan.candle_tables)):
        return 0
    return math.comb(len(plan.tables), candles) * len(plan.free_cells) ** 2 * (1 + len(plan.floor_cells))


def visit(name: str, net: Weights | None, seed: int) -> tuple[np.ndarray, ...] | None:
    """Return the labelled data of a house, as in `Learner.heard`, or None."""
    plan, random = FloorPlan.load(name), np.random.default_rng([seed, *map(ord, name)])
    if not len(plan.hazards) or not 0 < _states(plan) <= STATES:
        return None  # too large for foresight, or slow
    teacher, heard = Teacher(plan, objective=OBJECTIVE), []
    for children, episodes in ((1, EPISODES), (2, PAIRS)):
        learner = Learner(plan, net, teacher, random)
        world = GridWorld(plan, [0.5] * children, learner)
        for behaviour in world.behaviours:
            epsilons = np.resize(EPSILONS, episodes) + random.uniform(-0.1, 0.1, episodes)
            epsilons = np.clip(epsilons, 0.02, 1.0)
            behaviour.epsilons = lambda _, epsilons=epsilons: epsilons
        seeds = random.integers(2**31, size=episodes)
        world.run([RandomStream.draw_group(np.random.RandomState(one), children) for one in seeds])
        heard += learner.heard
    return tuple(np.concatenate(part) for part in zip(*heard, strict=True))


def gradients(
    net: Weights, rows: np.ndarray, worlds: np.ndarray, counts: np.ndarray, worse: np.ndarray, loose: float = LOOSE
) -> tuple[float, Weights]:
    """Return the expected regret of the network's draws, in damage, and the gradients of the loss.

    The loss is the regret minus the weighted entropy. `worse` is the regret of each option, (N,); the other arguments
    are as for `layers`.
    """
    first, (x, world, one, around, two, score) = np.cumsum(counts) - counts, layers(net, rows, worlds, counts)
    score = np.exp(score - np.maximum.reduceat(score, first).repeat(counts))
    share = score / np.add.reduceat(score, first).repeat(counts)
    cost = worse + loose * np.log(np.maximum(share, 1e-12))
    by_score = share * (cost - np.add.reduceat(share * cost, first).repeat(counts)) / np.float32(len(counts))
    by_two = by_score[:, None] * net["w3"] * (two > 0)
    together = np.add.reduceat(by_two, first)
    back = together @ net["u2"].T / counts[:, None].astype(two.dtype)
    by_one = (by_two @ net["w2"].T + back.repeat(counts, axis=0)) * (one > 0)
    by_world = np.add.reduceat(by_one, first)
    found = {"w1": x.T @ by_one, "v1": world.T @ by_world, "b1": by_world.sum(axis=0), "w2": one.T @ by_two}
    found |= {"u2": around.T @ together, "b2": together.sum(axis=0), "w3": two.T @ by_score, "skip": x.T @ by_score}
    return float((share * worse).sum()) / len(counts), found


def begin(rows: np.ndarray, worlds: np.ndarray, random: np.random.Generator) -> Weights:
    """Return initial weights, scaled by some features."""
    draw = lambda *shape: random.standard_normal(shape) * np.sqrt(2 / shape[0])  # noqa: E731
    net = {"w1": draw(rows.shape[1], HIDDEN), "v1": 0.5 * draw(worlds.shape[1], HIDDEN), "b1": np.zeros(HIDDEN)}
    net |= {"w2": draw(HIDDEN, HIDDEN), "u2": 0.3 * draw(HIDDEN, HIDDEN), "b2": np.zeros(HIDDEN)}
    net |= {"w3": 0.3 * draw(HIDDEN), "skip": np.zeros(rows.shape[1])}
    for some, end in (rows, ""), (worlds, "_world"):
        net |= {"mean" + end: some.mean(axis=0), "spread" + end: np.maximum(some.std(axis=0), 0.01)}
    return {name: value.astype(np.float32) for name, value in net.items()}


def fit(
    net: Weights, data: tuple[np.ndarray, ...], passes: int, random: np.random.Generator, seconds: float = np.inf
) -> tuple[Weights, float]:
    """Return the weights after some passes through the data (Adam), and the mean loss of the last one."""
    (rows, worlds, counts, damage), until = data, time.monotonic() + seconds
    first = np.cumsum(counts) - counts
    worse = np.minimum(damage - np.minimum.reduceat(damage, first).repeat(counts), MOST)
    useful = np.flatnonzero(np.add.reduceat(worse, first) > 0)  # decisions whose options differ
    means, squares = ({name: np.zeros_like(value) for name, value in net.items()} for _ in range(2))
    net, kept, step, loss = dict(net), dict(net), 0, np.nan
    steps = passes * -(-len(useful) // BATCH)
    for _ in range(passes):
        losses, order = [], random.permutation(useful)
        for some in np.split(order, range(BATCH, len(order), BATCH)):
            size = counts[some]
            which = (first[some] - np.cumsum(size) + size).repeat(size) + np.arange(size.sum())
            loss, found = gradients(net, rows[which], worlds[some], size, worse[which])
            losses.append(loss)
            step += 1
            rate = np.float32(RATE * (0.5 + 0.5 * np.cos(np.pi * step / steps)))
            for name, gradient in found.items():
                means[name] += np.float32(1 - _BETA[0]) * (gradient - means[name])
                squares[name] += np.float32(1 - _BETA[1]) * (gradient**2 - squares[name])
                scale = np.sqrt(squares[name] / np.float32(1 - _BETA[1] ** step)) + np.float32(1e-8)
                net[name] = net[name] - rate * means[name] / np.float32(1 - _BETA[0] ** step) / scale
                kept[name] = kept[name] + np.float32(max(1 - _BETA[2], 1 / step)) * (net[name] - kept[name])
        loss = float(np.mean(losses)) if losses else 0.0
        if time.monotonic() > until:
            break
    return kept, loss


def regret(net: Weights, data: tuple[np.ndarray, ...]) -> float:
    """Return the mean regret of a decision, in damage."""
    rows, worlds, counts, damage = data
    first, score = np.cumsum(counts) - counts, layers(net, rows, worlds, counts)[-1]
    best = score == np.maximum.reduceat(score, first).repeat(counts)
    chosen = np.add.reduceat(damage * best, first) / np.add.reduceat(best, first)
    return float((chosen - np.minimum.reduceat(damage, first)).mean())


def judge(house: str, nets: list[Weights], who: list[str], episodes: int) -> np.ndarray | None:
    """Return the results of some caregivers in a house, `learned` with each network; None if it is too large.

    These are for each caregiver the damage in `episodes` of each of the paper's five novices, then processor seconds
    until the first decision, including preparations for the house, and of an episode after that, (caregivers, 5
    episodes + 2). The children draw the same with all.
    """
    plan, found, made = FloorPlan.load(house), [], dict[str, float]()
    if not _states(plan):
        return None
    seeds = [*range(episodes)] * len(EPSILONS)
    every = [(name, net) for name in who for net in (nets if name == "learned" else [None])]
    for name, net in every:
        caregiver, took = CAREGIVERS[name](plan), [0.0]  # seconds until each decision
        if isinstance(caregiver, LearnedCaregiver):
            caregiver.net = net
        for method in ("reset", "watch", "decide") if caregiver else ():
            setattr(caregiver, method, functools.partial(_timed, took, getattr(caregiver, method)))
        world = GridWorld(plan, 0.5, caregiver)
        world.behaviours[0].epsilons = lambda _: np.repeat(EPSILONS, episodes)
        ledger = world.run([RandomStream.draw_group(np.random.RandomState(seed), 1) for seed in seeds])
        made.setdefault(name, took[0])  # later networks reuse the preparations of the first
        found.append([*ledger.damage, made[name], sum(took[1:]) / len(seeds)])
    return np.array(found)


def _timed(took: list[float], method, *given):
    begun = time.process_time()
    answer = method(*given)
    took[-1] += time.process_time() - begun
    if method.__name__ == "decide":
        took.append(0.0)
    return answer


def show(found: np.ndarray, who: list[str], console: Console) -> None:
    """Print the results of caregivers in some houses, (houses, caregivers, ...), each as of `judge`."""
    damage = found[..., :-2].reshape(*found.shape[:2], len(EPSILONS), -1)[:, :, ::-1]
    console.print(
        f"Damage of an episode in {len(found)} houses, {damage.shape[3]} of each novice in each; what is closed of the "
        "way from the rule to foresight over all novices, with a 95 % interval over houses; seconds of the processor "
        "until the first decision in a house, and of an episode after that."
    )
    rows = [["caregiver", *(f"{epsilon:.0%} random" for epsilon in EPSILONS[::-1]), "closed", "first", "episode"]]
    rows.append(["---", *["---:"] * (len(rows[0]) - 1)])
    again = np.random.default_rng(0).integers(len(found), size=(9_999, len(found)))

    def add(name: str, those: list[int]) -> None:
        mean, (first, then), share = damage[:, those].mean(axis=(0, 1, 3)), found[:, those, -2:].mean(axis=(0, 1)), ""
        if name.startswith("learned") and "foresight" in who:
            sums = damage.sum(axis=(2, 3))
            less, most = (sums[:, who.index("rule")] - sums[:, some].mean(axis=1) for some in (those, [-1]))
            low, high = np.quantile(less[again].sum(axis=1) / most[again].sum(axis=1), [0.025, 0.975])
            share = f"{less.sum() / most.sum():.0%} ({low:.0%} to {high:.0%})"
        rows.append([name, *(f"{value:.2f}" for value in mean), share, f"{first:.2f}", f"{then:.3f}"])

    learned = [i for i, name in enumerate(who) if name.startswith("learned")]
    for i, name in enumerate(who):
        add(name, [i])
    if len(learned) > 1:
        add("learned, mean", learned)
    for row in rows:
        console.print(f"| {' | '.join(row)} |", markup=False, highlight=False, soft_wrap=True)


def draw(path: pathlib.Path, rows: list[dict[str, float]]) -> None:
    """Draw the learning curve."""
    figure = Figure(figsize=(6.4, 3.2), layout="constrained")
    axes = figure.subplots()
    houses = [row["houses"] for row in rows]
    axes.plot(houses, [row["regret"] for row in rows], "o-", label="in new houses, before training on them")
    axes.plot(houses, [row["loss"] for row in rows], "s-", label="of what is drawn, on all so far")
    axes.set(xlabel="houses", ylabel="regret a decision, damage", ylim=(0, None))
    axes.legend(frameon=False)
    figure.savefig(path)


class Run:
    """A training run in a folder, house by house."""

    def __init__(self, folder: pathlib.Path, houses: list[str], seed: int, jobs: int, minutes: float):
        self._folder, self._houses, self._seed, self._jobs = folder, houses, seed, jobs
        self._begun, self._seconds = time.monotonic(), 60 * minutes
        self._rows: list[dict[str, float]] = []
        self._parts: list[tuple[np.ndarray, ...]] = []

    def left(self) -> float:
        """Return the remaining seconds."""
        return self._begun + self._seconds - time.monotonic()

    def train(self, pool: concurrent.futures.Executor, progress: Progress) -> Weights:
        """Return the weights after all houses, or as many as there was time for."""
        net: Weights | None = None
        bar = progress.add_task("houses", total=len(self._houses))
        blocks = [self._houses[first : first + BLOCK] for first in range(0, len(self._houses), BLOCK)]
        for number, names in enumerate(blocks):
            new = self._hear(pool, names, net, lambda: progress.advance(bar))
            if not new:
                break
            self._parts += new
            kept = self._folder / f"block-{number}.npz"
            before = regret(net, _joined(new)) if net else np.nan
            if kept.exists():
                with np.load(kept) as file:
                    net, loss = {name: file[name] for name in file if name != "loss"}, float(file["loss"])
            else:
                random, data = np.random.default_rng([self._seed, number]), _joined(self._parts)
                net, loss = fit(net or begin(*data[:2], random), data, PASSES, random, max(1.0, 0.3 * self.left()))
                _save(kept, net | {"loss": np.array(loss)})
            self._note(number, before, loss, progress.console)
            if self.left() < 0.2 * self._seconds:
                break
        if net is None:
            raise CaregiverError(
                "houses must have some that foresight can plan, and --minutes be enough for one of them"
            )
        progress.console.print("the last passes through all data")
        return fit(net, _joined(self._parts), LAST, np.random.default_rng([self._seed, 10**6]), max(1.0, self.left()))[
            0
        ]

    def _hear(self, pool, names, net, done) -> list[tuple[np.ndarray, ...]]:
        """Return the labelled data of the houses of a block, as far as there is time."""
        files = {name: self._folder / f"{name}.npz" for name in names}
        waiting = collections.deque(name for name in names if not files[name].exists())
        running: dict[concurrent.futures.Future, str] = {}
        while waiting or running:
            while waiting and len(running) < self._jobs:
                if self.left() < 0.25 * self._seconds and (running or len(waiting) < len(names) or self._parts):
                    waiting.clear()
                    break
                name = waiting.popleft()
                running[pool.submit(visit, name, net, self._seed)] = name
            ready, _ = concurrent.futures.wait(running, return_when=concurrent.futures.FIRST_COMPLETED)
            for one in ready:
                found = one.result() or (np.zeros(0),) * len(_PARTS)
                _save(files[running.pop(one)], dict(zip(_PARTS, found, strict=True)))
        heard = []
        for file in (file for file in files.values() if file.exists()):
            done()
            with np.load(file) as found:
                if len(found["counts"]):
                    heard.append(tuple(found[part] for part in _PARTS))
        return heard

    def _note(self, number: int, before: float, loss: float, console: Console) -> None:
        decisions = sum(len(part[2]) for part in self._parts)
        minutes = (time.monotonic() - self._begun) / 60
        row = {"block": number, "houses": len(self._parts), "decisions": decisions, "regret": before, "loss": loss}
        self._rows.append(row | {"minutes": round(minutes, 2)})
        console.print(
            f"block {number}: {len(self._parts)} houses, {decisions} decisions, regret in new houses {before:.4f}, "
            f"of what is drawn {loss:.4f}, {minutes:.1f} min"
        )
        with open(self._folder / "curve.csv", "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, self._rows[0])
            writer.writeheader()
            writer.writerows(self._rows)
        draw(self._folder / "curve.svg", self._rows)


def _joined(parts: list[tuple[np.ndarray, ...]]) -> tuple[np.ndarray, ...]:
    return tuple(np.concatenate(part) for part in zip(*parts, strict=True))


def _save(path: pathlib.Path, arrays: Weights) -> None:
    """Write a file, whole or not at all."""
    part = path.with_suffix(".part")
    with open(part, "wb") as file:
        np.savez(file, **arrays)
    part.replace(path)


def _keep(path: pathlib.Path, asked: dict[str, object]) -> None:
    """Write the settings of a run; raise CaregiverError if it was started with others."""
    if path.exists() and (found := json.loads(path.read_text("utf-8"))) != asked:
        raise CaregiverError(f"a resumed run must have its seed and houses, {found}, got {asked}")
    path.write_text(json.dumps(asked), encoding="utf-8")


def mixed(sets: list[str]) -> list[str]:
    """Return the names of the houses of several sets, evenly interleaved."""
    names = [[plan.name for plan in houses_named(one)] for one in sets]
    order = sorted(
        ((i + 0.5) / len(some), which, name) for which, some in enumerate(names) for i, name in enumerate(some)
    )
    return [name for _, _, name in order]


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, required=True, metavar="DIR", help="folder of the run")
    parser.add_argument("--minutes", type=float, default=55.0, help="greatest duration (default: 55)")
    parser.add_argument("--seed", type=int, default=0, help="seed of episodes and weights (default: 0)")
    parser.add_argument(
        "--houses", nargs="+", metavar="SET", help=f"houses to learn in (default: {' '.join(HOUSES)}), or to judge in"
    )
    parser.add_argument("--jobs", type=int, default=2, help="number of processes (default: 2)")
    parser.add_argument(
        "--judge", nargs="*", metavar="DIR", help="judge a finished run, beside other runs and foresight"
    )
    parser.add_argument("--episodes", type=int, default=8, help="episodes of each novice to judge by (default: 8)")
    parser.add_argument("--resume", action="store_true", help="resume the run in DIR")
    given = parser.parse_args(arguments)
    sets, judges = given.houses or HOUSES, given.judge is not None
    if not judges and any(word in name for name in sets for word in ("test", "drawn")):
        parser.error("--houses must be none to be tested in")
    if not (given.minutes > 0 and given.episodes > 0):
        parser.error(f"--minutes and --episodes must be positive, got {given.minutes} and {given.episodes}")
    if given.out.exists() and any(given.out.iterdir()) and not (given.resume or judges):
        parser.error(f"--out must be empty without --resume, got {given.out}")
    folders = [given.out, *map(pathlib.Path, given.judge or ())]
    if missing := [str(folder) for folder in folders if judges and not (folder / WEIGHTS).exists()]:
        parser.error(f"--judge must be of runs that have {WEIGHTS}, got {' '.join(missing)}")
    given.out.mkdir(parents=True, exist_ok=True)
    if not judges:
        _keep(given.out / "run.json", {"seed": given.seed, "houses": [*sets]})
    console = Console()
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    every = mixed(sets)
    houses, who = every if judges and given.houses else every[:JUDGED], [*CAREGIVERS]
    context = multiprocessing.get_context("spawn")
    with (
        concurrent.futures.ProcessPoolExecutor(given.jobs, context) as pool,
        Progress(*columns, console=console) as progress,
    ):
        if judges:
            nets = [_read(folder) for folder in folders]
        else:
            run = Run(given.out, every[JUDGED:] or every, given.seed, given.jobs, given.minutes)
            nets, who = [run.train(pool, progress)], ["rule", "learned"]
            _save(given.out / WEIGHTS, {name: value.astype(np.float16) for name, value in nets[0].items()})
            console.print(
                f"{given.out / WEIGHTS}: how to have it decide is in docs/guide/training.md, A learned caregiver"
            )
            if run.left() < 0.05 * 60 * given.minutes:
                return
        bar, found = progress.add_task("judged", total=len(houses)), []
        for one in pool.map(functools.partial(judge, nets=nets, who=who, episodes=given.episodes), houses):
            found += [] if one is None else [one]
            progress.advance(bar)
    if not found:
        raise CaregiverError("houses must have some that foresight can plan, to judge in")
    at = who.index("learned")
    named = [f"learned, {folder.name}" for folder in folders] if judges else ["learned"]
    show(np.array(found), [*who[:at], *named, *who[at + 1 :]], console)


def _read(folder: pathlib.Path) -> Weights:
    with np.load(folder / WEIGHTS) as file:
        return {name: value.astype(float) for name, value in file.items()}


if __name__ == "__main__":
    main()
