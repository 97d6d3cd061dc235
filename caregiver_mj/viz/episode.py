"""An episode to film: the closed loop of house and caregiver, and what the display shows of it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.percept import Assessment
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.runner import keep_answers, make_house
from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.viz import moment
from caregiver_mj.viz.hud import HudState
from caregiver_mj.viz.moment import Forecast, Tile

_LIFTED = 0.05  # metres above its place at the start from which a candle is in the robot's hand


class Episode:
    """A closed loop that runs as far as one wants to see.

    Attributes:
        spec: Which one it is: the same, step for step, as an evaluation has.
        env: The environment, of this package.
        policy: The caregiver's, which acts in it, or None without a robot.
        foresees: Whether what the caregiver thinks may be coming is shown.
    """

    def __init__(self, spec: EpisodeSpec, foresees: bool = False, answers: str = "", cameras: Sequence[str] = ()):
        """Begin an episode in a house with some cameras; its caregiver's answers may be given again in its place.

        Raises:
            CaregiverError: There can be no such episode, or the caregiver does not think of what may be coming, or a
                camera is missing.
        """
        spec.check(replayed=bool(answers))
        self.spec, self.foresees = spec, foresees
        self._rollout = make_house(spec, answers=answers)
        self.env, self.policy = self._rollout.env, self._rollout.policy
        self.env.physics.check_cameras(cameras)
        self._keeping = keep_answers(self._rollout)
        self.answers = self._keeping.__enter__()  # for as long as there is the episode
        self._rollout.begin(spec.own_seed)
        self._rollout.notify()
        self._candle_rest = self._candles()[:, 2]
        self._trails: list[np.ndarray] = []  # a look each, (children, 2)
        self._forecast: tuple[Assessment | None, Forecast | None] = None, None  # the last one, and what it is of
        if foresees and self.forecast is None:
            raise CaregiverError(
                "caregiver must predict where children may be, as 'foresight' does, got one that does not"
            )

    def run_until(self, seconds: float) -> bool:
        """Run the simulation up to a time and look at the children; return whether the episode lasts so long."""
        rollout, period = self._rollout, self.env.control_timestep()
        lasts = rollout.run_on(until=lambda: (rollout.steps + 0.5) * period >= seconds)
        if lasts:
            self._trails.append(self._children())
        return lasts

    @property
    def seconds(self) -> float:
        """How long it has run in the simulated world."""
        return self._rollout.seconds

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
            self.env.task, self.policy, self._rollout.timestep.observation, self.spec.family, trails, self.env.physics
        )
        return dataclasses.replace(shown, forecast=self.forecast)

    def _children(self) -> np.ndarray:
        return moment.child_positions(self._rollout.timestep.observation, self.env.physics)

    def _candles(self) -> np.ndarray:
        return moment.candle_positions(self._rollout.timestep.observation)
