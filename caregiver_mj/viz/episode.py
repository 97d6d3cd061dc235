"""An episode for a film or viewer: the closed loop of house and caregiver, and its display state."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from caregiver_mj.caregivers.percept import Assessment
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.experiments.runner import keep_answers, make_house
from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.interventions.verb import verb_of
from caregiver_mj.plans.hazards import KINDS, NOTHING, TABLE, State
from caregiver_mj.viz.moment import ChildState, Forecast, HudState, Tile

_LIFTED = 0.05  # m; rise above its starting height from which a candle counts as in the robot's hand


class Episode:
    """A closed loop that runs up to a requested time; step for step as in an evaluation of its `spec`."""

    def __init__(self, spec: EpisodeSpec, foresees: bool = False, answers: str = "", cameras: Sequence[str] = ()):
        """Begin an episode in the house, with `foresees` to show predictions if the caregiver makes any.

        `answers` of an earlier run are replayed in the caregiver's place; the house must have the `cameras`.

        Raises:
            CaregiverError: The specification is invalid, or a camera is missing.
        """
        spec.check(replayed=bool(answers))
        self.spec, self.foresees = spec, foresees
        self._rollout = make_house(spec, answers=answers)
        self.env, self.policy = self._rollout.env, self._rollout.policy
        self.env.physics.check_cameras(cameras)
        self._keeping = keep_answers(self._rollout)
        self.answers = self._keeping.__enter__()  # for the lifetime of the episode
        self._rollout.begin(spec.own_seed)
        self._rollout.notify()
        self._candle_rest = self._candles()[:, 2]
        self._trails: list[np.ndarray] = []  # of the children, (children, 2) at each look
        self._forecast: tuple[Assessment | None, Forecast | None] = None, None  # the last one, and its source

    def run_until(self, seconds: float) -> bool:
        """Run the simulation up to a time and extend the trails; return whether the episode lasts so long."""
        rollout, period = self._rollout, self.env.control_timestep()
        lasts = rollout.run_on(until=lambda: (rollout.steps + 0.5) * period >= seconds)
        if lasts:
            self._trails.append(self._children())
        return lasts

    @property
    def seconds(self) -> float:
        """Simulated time since the start, s."""
        return self._rollout.seconds

    @property
    def forecast(self) -> Forecast | None:
        """The caregiver's predictions, if they are shown."""
        assessment = self.policy.assessment if self.policy and self.foresees else None
        if assessment is not self._forecast[0]:
            self._forecast = assessment, Forecast.of(assessment)
        return self._forecast[1]

    def tiles(self) -> list[Tile]:
        """Return the predictions as tiles on the floor."""
        return self.forecast.tiles(self.env.task.plan, self._candles()) if self.forecast else []

    def overview(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Return place and direction of the overview camera, (3,) each, and its distance from the floor ahead, m."""
        camera = self.env.physics.model.ptr.camera("overview")
        ahead = -camera.mat0.reshape(3, 3)[:, 2]
        return camera.pos, ahead, -camera.pos[2] / ahead[2]

    def child_to_carried_candle(self) -> float:
        """Return the least distance of a child from a candle in the robot's hand, m; infinite if there is none."""
        candles = self._candles()
        carried = candles[candles[:, 2] > self._candle_rest + _LIFTED, :2]
        offset = carried[:, None] - self._children()  # (candles, children, 2)
        return float(np.linalg.norm(offset, axis=2).min(initial=math.inf))

    def hud_state(self, trail_length: int) -> HudState:
        """Return the display state, with the latest `trail_length` looks at the children as their trails."""
        task, policy, observation = self.env.task, self.policy, self._rollout.timestep.observation
        outcome, assessment = task.outcome(), policy.assessment if policy else None
        intervention = policy.intervention if policy else None
        positions = self._children()
        trails = np.array(self._trails[-trail_length:]).reshape(-1, len(positions), 2)
        seen = observation.get("toddler_seen", np.ones(len(positions)))
        safe, danger, unsafe_danger = [None] * len(positions), None, None
        if assessment is not None:
            safe, unsafe_danger = assessment.safe[0].tolist(), assessment.urgency[0]
            danger = unsafe_danger * (1.0 - assessment.safe[0]).max()
        by_child = outcome["damage_by_child"]
        each = zip(positions, trails.swapaxes(0, 1), safe, by_child, map(bool, seen), strict=True)
        return HudState(
            plan=task.plan,
            timestep=min(int(observation["clock"] + 1e-6), EPISODE_TIMESTEPS),
            family=str(self.spec.family),
            children=tuple(itertools.starmap(ChildState, each)),
            candles=self._candles(),
            damage=outcome["damage"],
            damages={
                kind.at.split()[-1]: outcome[f"damage_{kind.name}"]
                for kind in KINDS
                if kind is TABLE or kind in task.plan.hazards.kinds  # room is scarce
            },
            robot=observation.get("base_position"),
            danger=danger,
            unsafe_danger=unsafe_danger,
            target=policy.target if policy else NOTHING,
            mark=verb_of(intervention.verb).mark(task.plan, intervention) if intervention else None,
            intervention=policy.activity if policy else "",
            forecast=self.forecast,
            gates=observation.get("gate_position", np.zeros(0)).tolist(),
            gone=np.flatnonzero(task.children.state == State.GONE).tolist(),
            in_view=getattr(policy, "in_view", None),
        )

    def _children(self) -> np.ndarray:
        """Return the places of all children, seen by the caregiver or not, (children, 2), m."""
        return self.env.physics.toddler_positions()[:, :2]

    def _candles(self) -> np.ndarray:
        """Return the places of the candles, (candles, 3), m."""
        return self._rollout.timestep.observation.get("candle_position", np.empty((0, 3)))
