"""How well observations show what there is in the house: errors, gaps and delay. All of it is off by default."""

from __future__ import annotations

import dataclasses
import numbers
from collections.abc import Mapping
from typing import Any

from caregiver_mj.errors import CaregiverError

LONGEST_DELAY = 1.0  # seconds
_OFTENEST = 0.95  # probability of a gap, at most


@dataclasses.dataclass(frozen=True)
class Blur:
    """Errors in which one kind of thing is seen, normally distributed.

    White errors are drawn at every control timestep. Lasting ones belong to a sighting: those of the base and of a
    child last for the episode, and those of a candle until it is lifted, set down, or let go.

    Attributes:
        noise: White error of the position, one sigma along each axis, metres.
        bias: Lasting error of it, likewise.
        turn_noise: White error of the heading, of a candle about each axis, one sigma, radians.
        turn_bias: Lasting error of it, likewise.
        velocity_noise: White error of the velocity, one sigma, m/s, and of the rate of turning, rad/s; not of candles.
        dropout: Probability that it is not seen in a control timestep, so that what was seen last is shown again.
    """

    noise: float = 0.0
    bias: float = 0.0
    turn_noise: float = 0.0
    turn_bias: float = 0.0
    velocity_noise: float = 0.0
    dropout: float = 0.0

    @property
    def is_exact(self) -> bool:
        """Whether things are seen as they are."""
        return self == Blur()


@dataclasses.dataclass(frozen=True)
class Sensing:
    """How well a task's observations show what there is.

    Attributes:
        candle: Errors in which candles are seen.
        child: Errors in which children are seen.
        base: Errors in which the robot knows where its base is.
        delay: How old all that is, and what is known of arm and fingers, seconds; in whole control timesteps, rounded
            up. The clock is the robot's own.
    """

    candle: Blur = Blur()
    child: Blur = Blur()
    base: Blur = Blur()
    delay: float = 0.0

    @classmethod
    def of(cls, value: Sensing | Mapping[str, Any] | None) -> Sensing:
        """Sensing from what people write: None for exact, or a dictionary such as `{"candle": {"noise": 0.01}}`.

        Raises:
            CaregiverError: A name is unknown, or a number out of range.
        """
        sensing = value if isinstance(value, cls) else cls(**_known("sensing", cls, {} if value is None else value))
        blurs = {name: _blur(name, getattr(sensing, name)) for name in KINDS}
        _check("delay", sensing.delay, LONGEST_DELAY)
        return dataclasses.replace(sensing, candle=blurs["candle"], child=blurs["child"], base=blurs["base"])

    @property
    def is_exact(self) -> bool:
        """Whether observations show everything as it is now."""
        return self == Sensing()

    def delay_steps(self, control_timestep: float) -> int:
        """The delay in control timesteps of some seconds."""
        return -int(-(self.delay / control_timestep - 1e-6) // 1) if self.delay else 0


KINDS = ("candle", "child", "base")  # of what is seen


def _blur(kind: str, value: Blur | Mapping[str, Any]) -> Blur:
    """A valid blur of a kind of thing."""
    blur = value if isinstance(value, Blur) else Blur(**_known(f"sensing: {kind}", Blur, value))
    for field in dataclasses.fields(Blur):
        most = _OFTENEST if field.name == "dropout" else None
        _check(f"{kind}.{field.name}", getattr(blur, field.name), most)
    if kind == "candle" and blur.velocity_noise:
        raise CaregiverError("sensing: candle.velocity_noise is of no use, for no velocity of a candle is observed")
    return blur


def _known(what: str, cls: type, value: Any) -> Mapping[str, Any]:
    """A dictionary all of whose keys are fields of a class.

    Raises:
        CaregiverError: It is none, or one of them is not.
    """
    if not isinstance(value, Mapping):
        raise CaregiverError(f"{what} must be a {cls.__name__} or a dictionary, not {value!r}")
    names = [field.name for field in dataclasses.fields(cls)]
    for name in value:
        if name not in names:
            raise CaregiverError(f"{what} has no '{name}': there are {', '.join(names)}")
    return value


def _check(name: str, value: Any, most: float | None) -> None:
    """Raises CaregiverError unless a number is in 0 to a bound, or any finite one from 0 on."""
    number = isinstance(value, numbers.Real) and not isinstance(value, bool)
    if not (number and 0 <= value < float("inf") and (most is None or value <= most)):
        span = "0 or more" if most is None else f"in 0 to {most:g}"
        raise CaregiverError(f"sensing: {name} must be {span}, not {value!r}")
