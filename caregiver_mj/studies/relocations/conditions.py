"""Under what conditions candles are relocated: what the robot sees, how high tables are, and what it all is made of."""

from __future__ import annotations

import dataclasses
from typing import Any

import mujoco

from caregiver_mj.house.physics import Physics
from caregiver_mj.house.sensing import Blur, Sensing

_OFFSETS = {"candle_offset": 0.03, "table_offset": 0.04}  # metres, at most, in x and in y


@dataclasses.dataclass(frozen=True)
class Conditions:
    """What all relocations of a study have in common.

    Attributes:
        noise: Lasting error of perceived candle positions, one sigma, metres.
        white: White error of them, likewise.
        white_base: White error of the base's position, likewise.
        white_child: White error of the child's, likewise.
        dropout: Probability that each of them is not seen in a control timestep.
        delay: How old it is what is seen, seconds.
        table_height: Of all tables, or the lowest and the highest, metres; none for that of the model.
        friction: Of everything, as a multiple of the model's.
        mass: Of candles, likewise.
        gain: Of the robot's servos, likewise.
        knock: Whether every candle is knocked over before the robot comes.
        embodiment: Name of the robot; None for the task's own.
    """

    noise: float = 0.0
    white: float = 0.0
    white_base: float = 0.0
    white_child: float = 0.0
    dropout: float = 0.0
    delay: float = 0.0
    table_height: tuple[float, ...] = ()
    friction: float = 1.0
    mass: float = 1.0
    gain: float = 1.0
    knock: bool = False
    embodiment: str | None = None

    def task_kwargs(self) -> dict[str, Any]:
        """Arguments of the task."""
        sensing = Sensing(
            candle=Blur(noise=self.white, bias=self.noise, dropout=self.dropout),
            child=Blur(noise=self.white_child, dropout=self.dropout),
            base=Blur(noise=self.white_base, dropout=self.dropout),
            delay=self.delay,
        )
        options = {
            "sensing": None if sensing.is_exact else sensing,
            "table_height": self.table_height or None,
            "embodiment": self.embodiment,
        }
        return _OFFSETS | {name: value for name, value in options.items() if value is not None}

    def alter(self, physics: Physics) -> None:
        """Makes the things in a house what they are under these conditions. Before an episode."""
        model = physics.model.ptr
        model.geom_friction[:] *= self.friction
        for body in range(model.nbody):
            if model.body(body).name.startswith("candle_"):
                model.body_mass[body] *= self.mass
                model.body_inertia[body] *= self.mass
        model.actuator_gainprm[:] *= self.gain
        model.actuator_biasprm[:] *= self.gain
        if self.mass != 1.0:
            mujoco.mj_setConst(model, mujoco.MjData(model))  # what follows from the masses


# Each of what a real house does to it, and all of it together at half strength.
EACH = {
    "plain": Conditions(),
    "white noise 1 cm": Conditions(white=0.01),
    "bias 5 mm": Conditions(noise=0.005),
    "delay 60 ms": Conditions(delay=0.06),
    "tables .45 to .75 m": Conditions(table_height=(0.45, 0.75)),
    "friction x 0.5": Conditions(friction=0.5),
    "friction x 1.5": Conditions(friction=1.5),
    "candle mass x 3": Conditions(mass=3.0),
    "servo gains x 0.8": Conditions(gain=0.8),
    "all, half as strong": Conditions(
        noise=0.0025, white=0.005, delay=0.03, table_height=(0.525, 0.675), friction=0.75, mass=2.0, gain=0.9
    ),
}
