"""An episode to film: the closed loop of house and caregiver, and what the display shows of it."""

from __future__ import annotations

import dataclasses
import math
import os
import shlex

import numpy as np

from caregiver_mj.caregivers.answers import kept, packed, replayed
from caregiver_mj.caregivers.percept import Assessment
from caregiver_mj.children.family import Family
from caregiver_mj.errors import CaregiverError, check_integer
from caregiver_mj.experiments.settings import episode_random, episode_seed
from caregiver_mj.house.rendering import control
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.policy.own import OwnPolicy, make_policy
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.robot.embodiment import DEFAULT
from caregiver_mj.tasks import load
from caregiver_mj.viz import moment
from caregiver_mj.viz.forecast import Forecast, Tile
from caregiver_mj.viz.hud import HudState

_LIFTED = 0.05  # metres above its place at the start from which a candle is in the robot's hand


class Episode:
    """A closed loop that runs as far as one wants to see.

    Attributes:
        env: The environment, of this package.
        policy: The caregiver's, which acts in it, or None without a robot.
        family: The children in it, as they are to be called.
        foresees: Whether what the caregiver thinks may be coming is shown.
    """

    def __init__(
        self,
        env: control.Environment,
        policy: CaregiverPolicy | OwnPolicy | None,
        family: Family,
        foresees: bool = False,
    ):
        """Begin an episode of an environment, as the attributes say.

        Raises:
            CaregiverError: The caregiver does not think of what may be coming.
        """
        self.env, self.policy, self.family, self.foresees = env, policy, family, foresees
        self._keeping = kept(getattr(policy, "caregiver", None))
        self._answers = self._keeping.__enter__()  # for as long as there is the episode
        self._actions: list[np.ndarray] = []  # of a policy that is no caregiver's
        self._timestep = env.reset()
        self._action = self._decide()
        self._steps = 0
        self._candle_rest = self._candles()[:, 2]
        self._trails: list[np.ndarray] = []  # a look each, (children, 2)
        self._forecast: tuple[Assessment | None, Forecast | None] = None, None  # the last one, and what it is of
        if foresees and self.forecast is None:
            raise CaregiverError(
                "caregiver must predict where children may be, as 'foresight' does, got one that does not"
            )

    def run_until(self, seconds: float) -> bool:
        """Run the simulation up to a time and look at the children; return whether the episode lasts so long."""
        period = self.env.control_timestep()
        while (self._steps + 0.5) * period < seconds:
            if self._timestep.last():
                return False
            try:
                self._timestep = self.env.step(self._action)
            except control.PhysicsError:
                raise CaregiverError(f"the simulation diverged at {self.seconds:.1f} s of the episode") from None
            self._action = self._decide()
            self._steps += 1
        self._trails.append(self._children())
        return True

    def answers(self) -> str:
        """Return what the caregiver or policy has answered so far, for a replay."""
        return packed(actions=np.array(self._actions)) if self._actions else self._answers()

    @property
    def seconds(self) -> float:
        """How long it has run in the simulated world."""
        return self._steps * self.env.control_timestep()

    @property
    def forecast(self) -> Forecast | None:
        """What may be coming, if that is shown."""
        assessment = self.policy.assessment if self.policy and self.foresees else None
        if assessment is not self._forecast[0]:
            self._forecast = assessment, Forecast.of(assessment)
        return self._forecast[1]

    def tiles(self) -> list[Tile]:
        """Return it as tiles, to be laid on the floor."""
        return self.forecast.tiles(self.env.task.plan, self._candles()) if self.forecast else []

    def overview(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Return where the overview camera is, metres, which way it looks, and after how many metres at the floor."""
        camera = self.env.physics.model.ptr.camera("overview")
        ahead = -camera.mat0.reshape(3, 3)[:, 2]
        return camera.pos, ahead, -camera.pos[2] / ahead[2]

    def child_to_carried_candle(self) -> float:
        """Return the least distance (m) of a child from a candle that is in the robot's hand; infinite if none is."""
        candles = self._candles()
        carried = candles[candles[:, 2] > self._candle_rest + _LIFTED, :2]
        offset = carried[:, None] - self._children()  # (candles, children, 2)
        return float(np.linalg.norm(offset, axis=2).min(initial=math.inf))

    def hud_state(self, trail_length: int) -> HudState:
        """Return what the display shows now, with so many of the latest looks at the children as their trails."""
        trails = self._trails[-trail_length:]
        shown = moment.hud_state(
            self.env.task, self.policy, self._timestep.observation, self.family, trails, self.env.physics
        )
        return dataclasses.replace(shown, forecast=self.forecast)

    def _decide(self) -> np.ndarray:
        if self.policy is None:
            return np.zeros(self.env.action_spec().shape)
        action = self.policy(self._timestep)
        if isinstance(self.policy, OwnPolicy):
            self._actions.append(action)
        return action

    def _children(self) -> np.ndarray:
        return moment.child_positions(self._timestep.observation, self.env.physics)

    def _candles(self) -> np.ndarray:
        return moment.candle_positions(self._timestep.observation)


@dataclasses.dataclass(frozen=True)
class Watched:
    """An episode of a run: the same, step for step, as an evaluation with this seed has."""

    house: str | os.PathLike[str] | FloorPlan = "paper"  # a floor plan, or the name or file of one
    family: Family = dataclasses.field(default_factory=Family)  # the children
    caregiver: str = "foresight"  # name of the caregiver, or of a policy; without a robot for "none"
    seed: int = 0  # seed of the run
    # number of the episode; None if the seed is that of a single episode, which belongs to no run
    number: int | None = 0
    damage: DamageWeights = DamageWeights()  # what collisions cost, where the house is not a floor plan that says so
    embodiment: str = DEFAULT  # name of the robot
    sight: str = "all"  # what the caregiver has to see with
    task: str = "supervise"  # one of `caregiver_mj.ALL_TASKS`; evaluations are of "supervise"
    # what is given again in the caregiver's place, see `caregiver_mj.caregivers.answers`, if anything
    answers: str = ""

    def begin(self, foresees: bool = False) -> Episode:
        """Begin the episode, which may show what the caregiver thinks may be coming.

        Raises:
            CaregiverError: There can be no such episode.
        """
        for what, value in (("seed", self.seed), ("episode", 0 if self.number is None else self.number)):
            check_integer(what, value, 0)
        random = episode_random(self.seed if self.number is None else episode_seed(self.seed, self.number))
        robot = self.caregiver != "none"
        kwargs = {"robot": robot, "embodiment": self.embodiment}
        plan = self.house if isinstance(self.house, FloorPlan) else FloorPlan.load(self.house, damage=self.damage)
        env = load(self.task, house=plan, epsilon=self.family, random=random, task_kwargs=kwargs, sight=self.sight)
        who = replayed(plan, self.answers) if self.answers else self.caregiver
        return Episode(env, make_policy(env, who, self.seed) if robot else None, self.family, foresees)

    def options(self) -> str:
        """Return the options that say the same on the command line."""
        house = self.house.name if isinstance(self.house, FloorPlan) else self.house
        said: dict[str, object] = {"house": house, "epsilon": self.family}
        said |= {"caregiver": self.caregiver, "seed": self.seed}
        if self.number is not None:
            said["episode"] = self.number
        usual = Watched()
        for name in ("damage", "embodiment", "sight"):
            if (value := getattr(self, name)) != getattr(usual, name):
                said[name] = value
        return shlex.join(str(word) for name, value in said.items() for word in (f"--{name}", value))
