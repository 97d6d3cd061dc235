"""The caregiver: what to protect next. It never knows whether its world is the grid or the house.

A world shows it an `Observation` and carries out the `Intervention` that it answers with. Both hold a batch of
worlds, so that the grid can run thousands of episodes at once; the house is a batch of one.

Candidates for protection are numbered through: first the stairwells, then the candles of the floor plan.
"""

from __future__ import annotations

import abc
import dataclasses
import importlib.metadata
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from caregiver_mj.children import novice
from caregiver_mj.danger import safety
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans.floor_plan import FloorPlan

NOTHING = -1  # no candidate, no candle, no action
EXPERT_TIMESTEPS = 1000  # paper, section V.C
ENTRY_POINTS = "caregiver_mj.caregivers"  # the group in which other packages offer theirs


@dataclasses.dataclass(frozen=True)
class Observation:
    """What the caregiver sees of B worlds at one moment.

    Attributes:
        novice_cell: Index of the novice's free cell, (B,).
        previous_cell: The cell in which it made its last move, (B,).
        previous_action: That move, an index into `ACTIONS`, or NOTHING before the first, (B,).
        caregiver_cell: Index of the caregiver's own cell in `FloorPlan.caregiver_cells`, (B,).
        candle_table: Index of the table on which each candle is, (B, candles), or NOTHING for one that is on none
            (it is in the caregiver's hand, or on the floor).
        holding: Index of the candle in the caregiver's hand, or NOTHING, (B,).
        candle_cell: Index of the free cell on whose floor each candle is, (B, candles), or NOTHING. Left out where
            no candle can be on the floor, as in the grid.
        out_of_reach: Whether a candidate is to be passed over because the caregiver could not get to it lately,
            (B, candidates). Left out if there is none.
    """

    novice_cell: np.ndarray
    previous_cell: np.ndarray
    previous_action: np.ndarray
    caregiver_cell: np.ndarray
    candle_table: np.ndarray
    holding: np.ndarray
    candle_cell: np.ndarray | None = None
    out_of_reach: np.ndarray | None = None

    def __post_init__(self) -> None:
        if self.candle_cell is None:
            object.__setattr__(self, "candle_cell", np.full(np.shape(self.candle_table), NOTHING))
        if self.out_of_reach is None:
            object.__setattr__(self, "out_of_reach", np.zeros((len(self.novice_cell), 1), bool))


@dataclasses.dataclass(frozen=True)
class Assessment:
    """The numbers behind a decision.

    Attributes:
        safe: P(safe|tau), (B,).
        reach: P(reach_o|tau) of every candidate, (B, candidates).
        danger: Expected danger of every candidate, (B, candidates).
    """

    safe: np.ndarray
    reach: np.ndarray
    danger: np.ndarray


class Caregiver(abc.ABC):
    """Decides what to protect. One instance serves one batch of episodes at a time."""

    def __init__(self, plan: FloorPlan, seed: int = 0):
        """Prepares a caregiver for a house.

        Args:
            plan: The house.
            seed: Seed for whatever is random in the caregiver.
        """
        self.plan = plan
        self.seed = seed
        self.stairwell_count = len(plan.stairwells)
        self.table_distances = plan.graph.bump_distances(plan.tables).astype(float)  # (free cells, tables)
        self.stairwell_distances = plan.graph.bump_distances(plan.stairwells).astype(float)  # (free cells, stairwells)

    def reset(self, batch: int, seeds: Sequence[int] | None = None) -> None:  # noqa: B027 (most remember nothing)
        """Begins B new episodes.

        Args:
            batch: B.
            seeds: A seed for each episode, for caregivers that draw lots: an episode must not depend on its batch.
        """

    def watch(self, observation: Observation) -> None:  # noqa: B027
        """Takes in the novice's last move. Called once a novice timestep."""

    @abc.abstractmethod
    def decide(self, observation: Observation) -> np.ndarray:
        """Chooses the candidate to protect now, (B,), or NOTHING. Called as often as the world likes."""

    def safe_table(self, observation: Observation, candle: np.ndarray) -> np.ndarray:
        """Chooses where a candle shall go: the bare table farthest, on foot, from the novice.

        Args:
            observation: What is seen at the moment of the pick.
            candle: Index of the candle for each world, (B,).

        Returns:
            Table indices (B,).
        """
        distance = self.table_distances[observation.novice_cell].copy()
        worlds, candles = np.nonzero(observation.candle_table != NOTHING)
        distance[worlds, observation.candle_table[worlds, candles]] = -np.inf  # not bare
        return distance.argmax(axis=1)

    def worth_protecting(self, observation: Observation) -> np.ndarray:
        """Which candidates the caregiver can do something about, (B, candidates).

        Every stairwell, and every candle that would be farther from the novice on a bare table than where it is; but
        none that is out of reach.
        """
        distance, table = self.table_distances[observation.novice_cell], observation.candle_table
        bare = np.ones(distance.shape, bool)
        worlds, candles = np.nonzero(table != NOTHING)
        bare[worlds, table[worlds, candles]] = False
        farthest = np.where(bare, distance, 0.0).max(axis=1, initial=0.0)
        candle = self.candidate_distances(observation)[:, self.stairwell_count :] < farthest[:, None]
        worth = np.concatenate([np.ones((len(table), self.stairwell_count), bool), candle], axis=1)
        return worth & ~observation.out_of_reach

    def candidate_distances(self, observation: Observation) -> np.ndarray:
        """Novice timesteps to a collision with each candidate, (B, candidates); infinite for a carried candle.

        One collides with a candle on the floor by stepping into its cell, if one is not in there already.
        """
        cell, table = observation.novice_cell, observation.candle_table
        candles = np.where(table == NOTHING, np.inf, self.table_distances[cell[:, None], table])
        for world, candle in np.argwhere(observation.candle_cell != NOTHING):
            steps = self.plan.graph.distances_from([observation.candle_cell[world, candle]])[0, cell[world]]
            candles[world, candle] = max(1, steps)
        return np.concatenate([self.stairwell_distances[cell], candles], axis=1)

    @property
    def candidate_damage(self) -> np.ndarray:
        """d_o of every candidate, (candidates,)."""
        stairwells = np.full(self.stairwell_count, novice.STAIRWELL_DAMAGE)
        return np.concatenate([stairwells, np.full(len(self.plan.candle_tables), novice.CANDLE_DAMAGE)])


class PaperCaregiver(Caregiver):
    """The paper's rule: protect the object of greatest expected danger (sections III and IV)."""

    def __init__(
        self,
        plan: FloorPlan,
        seed: int = 0,
        *,
        reach: str = "inverse",
        prior: str = "draw",
        hyperprior: float = safety.HYPERPRIOR,
        expert_timesteps: int = EXPERT_TIMESTEPS,
        threshold: float = 0.0,
    ):
        """Learns the action prior from experts.

        Args:
            plan: The house.
            seed: Seed of the expert trajectories and the Dirichlet draw.
            reach: Reading of P(reach): "inverse" or "linear" distance.
            prior: theta_s as a "draw" from Dir(alpha_s), or its "mean".
            hyperprior: alpha_s^0(a).
            expert_timesteps: Length of all expert trajectories together.
            threshold: Expected danger below which nothing is done.

        Raises:
            CaregiverError: An unknown reading of P(reach) or of the prior.
        """
        super().__init__(plan, seed)
        for what, value, valid in (("reach", reach, ("inverse", "linear")), ("prior", prior, ("draw", "mean"))):
            if value not in valid:
                raise CaregiverError(f"{what} must be one of {', '.join(valid)}, not {value!r}")
        random = np.random.default_rng(seed)
        experts = novice.expert_trajectories(plan, random, expert_timesteps)
        alpha = safety.action_counts(experts, len(plan.free_cells), hyperprior)
        self.action_prior = (
            safety.action_prior_draw(alpha, random) if prior == "draw" else safety.action_prior_mean(alpha)
        )
        self._reach = reach
        self._threshold = threshold
        # Candles can come to stand on any table, so the largest distance is that over all tables.
        self._largest_distance = max(
            d.max() for d in (self.table_distances, self.stairwell_distances, np.ones(1)) if d.size
        )
        self._damage = self.candidate_damage
        self._log_ratio = np.zeros(1)

    def reset(self, batch: int, seeds: Sequence[int] | None = None) -> None:
        self._log_ratio = np.zeros(batch)

    def watch(self, observation: Observation) -> None:
        moved = observation.previous_action != NOTHING
        ratio = safety.log_likelihood_ratio(self.action_prior, observation.previous_cell, observation.previous_action)
        self._log_ratio += np.where(moved, ratio, 0.0)

    def assess(self, observation: Observation) -> Assessment:
        """P(safe|tau), P(reach|tau) and expected danger as they stand now."""
        distance = self.candidate_distances(observation)
        if self._reach == "inverse":
            reach = safety.reach_inverse(distance)
        else:
            reach = safety.reach_linear(distance, self._largest_distance)
        safe = safety.probability_safe(self._log_ratio)
        return Assessment(safe, reach, safety.expected_danger(safe, reach, self._damage))

    def decide(self, observation: Observation) -> np.ndarray:
        assessment = self.assess(observation)
        # 1 - P(safe) is common to all candidates and may round to 0 after a long safe walk; the choice among
        # them is therefore made without it, and only the threshold looks at the danger itself.
        urgency = np.where(self.worth_protecting(observation), assessment.reach * self._damage, 0.0)
        target, most = _first_of_greatest(urgency)
        danger = np.where(most > 0, (1.0 - assessment.safe) * most, -np.inf)
        return np.where(danger >= self._threshold, target, NOTHING)


class RandomCaregiver(Caregiver):
    """Draws, in every novice timestep, one of the candidates that are worth protecting.

    It draws once a timestep and not once an action, or it would turn round before it gets anywhere.
    """

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        self.reset(1)

    def reset(self, batch: int, seeds: Sequence[int] | None = None) -> None:
        seeds = [0] * batch if seeds is None else seeds
        length = novice.EPISODE_TIMESTEPS + 1
        self._draws = np.stack([np.random.default_rng((self.seed, int(s))).random(length) for s in seeds], axis=1)
        self._timestep = 0

    def watch(self, observation: Observation) -> None:
        self._timestep = (self._timestep + 1) % len(self._draws)

    def decide(self, observation: Observation) -> np.ndarray:
        worth = self.worth_protecting(observation)
        count = worth.sum(axis=1)
        chosen = novice.pick(self._draws[self._timestep], count)
        target, _ = _first_of_greatest(worth & (worth.cumsum(axis=1) == chosen[:, None] + 1))
        return np.where(count > 0, target, NOTHING)


class NearestCaregiver(Caregiver):
    """Protects what is nearest to the novice, whatever the damage."""

    def decide(self, observation: Observation) -> np.ndarray:
        distance = self.candidate_distances(observation)
        target, nearness = _first_of_greatest(np.where(self.worth_protecting(observation), 1.0 / distance, 0.0))
        return np.where(nearness > 0, target, NOTHING)


class GuardCaregiver(Caregiver):
    """Goes to the stairwell that is nearest to itself at the start, and stays there."""

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        landings = [plan.cell_index[cell] for cell in plan.stairwells]
        self._walk = plan.graph.distances_from(landings).T  # (caregiver cells, stairwells)
        self.reset(1)

    def reset(self, batch: int, seeds: Sequence[int] | None = None) -> None:
        self._post = np.full(batch, NOTHING)

    def decide(self, observation: Observation) -> np.ndarray:
        if self.stairwell_count:
            nearest = self._walk[observation.caregiver_cell].argmin(axis=1)
            self._post = np.where(self._post == NOTHING, nearest, self._post)
        return self._post


def _first_of_greatest(score: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The first candidate of the greatest score (NOTHING if there are none), and that score, both (B,).

    Scores that only rounding tells apart count as equal.
    """
    if score.shape[1] == 0:
        return np.full(len(score), NOTHING), np.zeros(len(score))
    greatest = score.max(axis=1)
    return (score >= greatest[:, None] * (1 - 1e-9)).argmax(axis=1), greatest


class _Caregivers(Mapping[str, "type[Caregiver] | None"]):
    """The caregivers by name: those above, then those that installed packages offer as entry points.

    The entry points are looked up at each use and not at import.
    """

    _OWN: Mapping[str, type[Caregiver] | None] = {
        "none": None,
        "random": RandomCaregiver,
        "nearest": NearestCaregiver,
        "guard": GuardCaregiver,
        "paper": PaperCaregiver,
    }

    def __getitem__(self, name: str) -> type[Caregiver] | None:
        if name in self._OWN:
            return self._OWN[name]
        entry = importlib.metadata.entry_points(group=ENTRY_POINTS)[name]
        try:
            maker = entry.load()
        except Exception as error:  # whatever somebody else's module raises
            raise CaregiverError(f"caregiver '{name}' ({entry.value}) cannot be loaded: {error}") from error
        if not (isinstance(maker, type) and issubclass(maker, Caregiver)):
            wanted = "caregiver_mj.caregivers.caregiver.Caregiver"
            raise CaregiverError(f"caregiver '{name}' ({entry.value}) is not a subclass of {wanted}")
        return maker

    def __contains__(self, name: object) -> bool:
        return name in list(self)  # without loading it

    def __iter__(self) -> Iterator[str]:
        offered = importlib.metadata.entry_points(group=ENTRY_POINTS).names
        return iter([*self._OWN, *sorted(set(offered) - set(self._OWN))])

    def __len__(self) -> int:
        return len(list(iter(self)))


CAREGIVERS: Mapping[str, type[Caregiver] | None] = _Caregivers()


def make_caregiver(name: str, plan: FloorPlan, seed: int = 0) -> Caregiver | None:
    """Makes a caregiver by name; "none" gives None.

    Raises:
        CaregiverError: There is none of that name, or another package's cannot be loaded.
    """
    if name not in CAREGIVERS:
        raise CaregiverError(f"no caregiver '{name}': there are {', '.join(CAREGIVERS)}")
    maker = CAREGIVERS[name]
    return maker(plan, seed) if maker else None
