"""dm-control tasks of the caregiver: the table of them, which needs no MuJoCo, and `load`."""

from __future__ import annotations

import dataclasses
import inspect
import numbers
import os
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS, Random, random_state
from caregiver_mj.errors import CaregiverError, UnknownOptionError, check_kind
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.visibility import Sight
from caregiver_mj.registry import named_object

if TYPE_CHECKING:
    ALL_TASKS: tuple[str, ...]

    from caregiver_mj.children.child_group import ChildrenLike
    from caregiver_mj.house.rendering import control
    from caregiver_mj.tasks.base import CareTask


@dataclasses.dataclass(frozen=True)
class TaskSpec:
    """A task by name. Its class, which holds everything else, is imported when the task is loaded."""

    name: str  # for `load` and the command line
    kind: str | type[CareTask]  # its class, or `module:class`
    version: int = 0  # version of its Gymnasium environment

    @property
    def id(self) -> str:
        """The name of its Gymnasium environment."""
        return f"caregiver_mj/{self.name.title().replace('_', '')}-v{self.version}"

    def find_kind(self) -> type[CareTask]:
        """Return the class of the task.

        Raises:
            CaregiverError: It cannot be loaded, is no subclass of `CareTask`, or lacks a method.
        """
        from caregiver_mj.tasks.base import CareTask  # imports MuJoCo, which the table of tasks does not need

        found = named_object(self.kind) if isinstance(self.kind, str) else self.kind
        if not (isinstance(found, type) and issubclass(found, CareTask)):
            raise CaregiverError(f"task '{self.name}' must be a subclass of CareTask, got {found!r}")
        if lacks := sorted(getattr(found, "__abstractmethods__", ())):
            raise CaregiverError(f"task '{self.name}' must have {', '.join(lacks)}, got {found.__name__} without")
        return found


TASKS: dict[str, TaskSpec] = {}


def register(task: TaskSpec) -> None:
    """Register a task, and its Gymnasium environment, if necessary later, when Gymnasium is imported."""
    TASKS[task.name] = task
    if sys.modules.get("gymnasium"):
        import gymnasium

        gymnasium.register(task.id, "caregiver_mj.envs.house:HouseEnv", kwargs={"task": task.name})


register(TaskSpec("supervise", "caregiver_mj.tasks.suite:Supervise"))
register(TaskSpec("relocate_candle", "caregiver_mj.tasks.suite:RelocateCandle"))
register(TaskSpec("block_stairs", "caregiver_mj.tasks.suite:BlockStairs"))


def __getattr__(name: str) -> tuple[str, ...]:
    if name == "ALL_TASKS":
        return tuple(TASKS)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")


def load(
    task: str,
    house: str | os.PathLike[str] | FloorPlan = "paper",
    epsilon: ChildrenLike | Sequence[ChildrenLike] = 0.5,
    random: Random = None,
    task_kwargs: dict[str, Any] | None = None,
    environment_kwargs: dict[str, Any] | None = None,
    visuals: bool = True,
    sight: Sight | str = "all",
) -> control.Environment:
    """Make an environment.

    Args:
        task: One of `ALL_TASKS`.
        house: A floor plan, its path, or its name, such as a house of the package or `house-17`.
        epsilon: Share of the novice's random moves, in [0, 1]; for several children the share of each, as in "1,.25".
            Or a `ChildGroup`, or a list of children.
        random: Source of all randomness, a `RandomState` or a `Generator`, from which episodes draw; or an integer
            seed; None for a fresh one.
        task_kwargs: Further arguments of the task, such as `embodiment`, the robot's name, or `robot=False`; `family`
            replaces epsilon, and `time_limit`, in seconds, that of the task.
        environment_kwargs: Further arguments of `dm_control.rl.control.Environment`.
        visuals: Whether to build visual geometry. Without it episodes are the same and run faster, and rendering raises
            `RenderingError`.
        sight: Children and things in observations: `all`, or those in the robot's view, as `Sight.of` takes it.

    Returns:
        A `dm_env.Environment`.

    Raises:
        CaregiverError: The task or robot is unknown, the house is invalid or unsuitable for the task, epsilon or the
            seed is out of range, or a further argument is unknown or invalid.
    """
    from caregiver_mj.house.physics import Physics  # imports MuJoCo, which the table of tasks does not need
    from caregiver_mj.house.rendering import control

    if not isinstance(task, str) or task not in TASKS:
        raise CaregiverError(f"no task '{task}': there are {', '.join(TASKS)}")
    plan = house if isinstance(house, FloorPlan) else FloorPlan.load(house)
    for what, kwargs in (("task_kwargs", task_kwargs), ("environment_kwargs", environment_kwargs)):
        check_kind(what, kwargs, dict, type(None))
    if random is not None and "random" in (task_kwargs or {}):
        raise CaregiverError("random must be given once, got it in task_kwargs, too")
    eyes = {} if str(sight) == "all" else {"sight": sight}  # a user's task need not have this argument
    kind, options = TASKS[task].find_kind(), {"family": epsilon, "random": random, **eyes, **(task_kwargs or {})}
    options["random"] = random_state(options["random"])
    if kind.needs and kind.needs.verb not in plan.hazards.verb:
        needed = f"a {kind.needs.name} ({kind.needs.symbol})"
        raise CaregiverError(f"{task} needs {needed}, and floor plan '{plan.name}' has none")
    if kind.needs_robot and not options.get("robot", True):
        raise CaregiverError(f"{task} needs the robot")
    seconds = _time_limit(options.pop("time_limit", None))
    _check_arguments("task_kwargs", kind, (plan,), options)
    made = kind(plan, **options)
    made.time_limit = seconds or made.time_limit or EPISODE_TIMESTEPS * made.novice_timestep
    environment_kwargs = environment_kwargs or {}
    for own in ("time_limit", "control_timestep"):
        if own in environment_kwargs:
            raise CaregiverError(f"environment_kwargs must be without {own}: give it in task_kwargs")
    _check_arguments("environment_kwargs", control.Environment, (None, made), environment_kwargs)
    robot = made.has_robot and made.embodiment
    physics = Physics.from_plan(plan, robot, made.table_positions, len(made.children), visuals, made.table_heights)
    try:
        # Half a step less, for dm_control divides the two again and may round to another step.
        limit = (made.length - 0.5) * made.control_timestep
        return control.Environment(
            physics, made, time_limit=limit, control_timestep=made.control_timestep, **environment_kwargs
        )
    except ValueError as error:  # from dm_control, for inconsistent timesteps
        raise CaregiverError(f"{task} cannot be made: {error}") from None


def _time_limit(seconds: float | None) -> float | None:
    """Return the length of an episode in seconds, which may be infinite; raise CaregiverError if it is invalid."""
    if seconds is not None and not (isinstance(seconds, numbers.Real) and seconds > 0):
        raise CaregiverError(f"time_limit must be a positive number of seconds, got {seconds!r}")
    return seconds


def _check_arguments(what: str, taker: Callable[..., Any], given: tuple[Any, ...], further: dict[str, Any]) -> None:
    """Raise UnknownOptionError unless a function takes these arguments."""
    try:
        inspect.signature(taker).bind(*given, **further)
    except TypeError as error:
        raise UnknownOptionError(f"{what}: {error}") from None
