"""Options shared by several commands."""

from __future__ import annotations

import argparse
import logging
import os
import shlex
import sys
from typing import Any

from caregiver_mj.caregivers.registry import CAREGIVERS, POLICIES, RULE
from caregiver_mj.caregivers.server import REAL_TIME, WAITS, Queries
from caregiver_mj.children.child_group import CHILDREN, NOVICE, ChildGroup
from caregiver_mj.children.walk import WALKING_SPEED
from caregiver_mj.cli import PROGRAM
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.run_folder import StorageError, read_block
from caregiver_mj.experiments.spec import SUPERVISE, EpisodeSpec
from caregiver_mj.experiments.workers import Executor, LocalExecutor
from caregiver_mj.outside import plain
from caregiver_mj.plans import floor_plan
from caregiver_mj.plans.floor_plan import FloorPlan, check_starts
from caregiver_mj.plans.generator import is_drivable
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.plans.sets import SETS, houses_named
from caregiver_mj.robot.embodiment import DEFAULT
from caregiver_mj.robot.embodiments import EMBODIMENTS

EXECUTORS = ("local", "dask")
BEST = "best"  # in the place of an episode's number
CAREGIVER = RULE[0]  # default of all commands


def _add_house(command: argparse._ActionsContainer) -> None:
    command.add_argument("--house", default="paper", metavar="NAME|FILE", help=houses())


def _add_damage(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--damage",
        default=str(DamageWeights()),
        metavar="KIND=D,...",
        help=f"damage of collisions with {', '.join(DamageWeights())}: stairwell=5,mug=5, or 5:4:1 for the first three",
    )


def read_house(arguments: argparse.Namespace) -> FloorPlan:
    """Return the house of the options of `add_who`, or of --answers."""
    if isinstance(arguments.house, FloorPlan):
        return arguments.house
    return FloorPlan.load(arguments.house, damage=arguments.damage)


def add_houses(command: argparse.ArgumentParser) -> None:
    """Add the options for houses, for `read_houses`."""
    either = command.add_mutually_exclusive_group()
    _add_house(either)
    either.add_argument(
        "--houses",
        nargs="+",
        metavar="SET|NAME",
        help=f"several houses: {', '.join(SETS)} (see `list sets`), or names and files",
    )
    _add_damage(command)


def read_houses(arguments: argparse.Namespace) -> tuple[FloorPlan, ...]:
    """Return the houses of the options of `add_houses`."""
    if arguments.houses is None:
        return (read_house(arguments),)
    return houses_named(arguments.houses, arguments.damage)


def add_who(command: argparse.ArgumentParser, others: str = "") -> None:
    """Add the options for house, children and caregiver; `others` lists further caregivers in the help."""
    _add_house(command)
    _add_damage(command)
    command.add_argument(
        "--epsilon",
        default="0.5",
        metavar="E[,E...]",
        help="share of random moves; for several children one each, such as 1,.25",
    )
    add_children(command)
    command.add_argument("--caregiver", default=CAREGIVER, metavar="NAME", help=f"{others}{caregivers()}")
    add_embodiment(command)


def read_spec(arguments: argparse.Namespace, **more: Any) -> EpisodeSpec:
    """Return the episode of the options of `add_who`, `add_episode` and `add_queries`, with further fields."""
    plan, house = read_house(arguments), arguments.house
    names = ("seed", "episode", "sight", "task", "child_speed")
    fields = {name: getattr(arguments, name) for name in names if name in arguments}
    return EpisodeSpec(
        plan,
        read_family(arguments.epsilon, arguments),
        arguments.caregiver,
        embodiment=arguments.embodiment,
        file="" if isinstance(house, FloorPlan) or house == plan.name else house,
        queries=read_queries(arguments),
        **fields | more,
    )


def add_episode(command: argparse.ArgumentParser, best: bool = False) -> None:
    """Add the options for an episode of a run; with `best`, that of `read_rescue` too."""
    add_seed(command, "seed of the run that the episode belongs to")
    text = "number of the episode in that run"
    if best:
        text += f", or {BEST}: where --caregiver prevented most damage in --answers"
    kind = _number_or_best if best else int
    command.add_argument("--episode", type=kind, default=0, metavar="N", help=text)
    add_sight(command)


def _number_or_best(text: str) -> int | str:
    try:
        return text if text == BEST else int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be a number or {BEST}, got '{text}'") from None


def add_sight(command: argparse.ArgumentParser) -> None:
    """Add the option for the caregiver's sight."""
    command.add_argument("--sight", default="all", help="what the caregiver sees: all, walls, camera or rooms:N")


def add_queries(command: argparse.ArgumentParser) -> None:
    """Add the options for remote caregivers, for `read_queries`."""
    usual, until = Queries(), "of the run and its resumptions, after which they abstain"
    command.add_argument("--base-url", metavar="URL", help="address of chat:MODEL; its key is in OPENAI_API_KEY")
    command.add_argument("--max-calls", type=int, metavar="N", help=f"requests to models and servers {until}")
    command.add_argument("--max-tokens", type=int, metavar="N", help=f"tokens of models {until}")
    command.add_argument(
        "--patience", type=float, default=usual.patience, metavar="S", help="seconds for an answer of a model or server"
    )
    command.add_argument(
        "--thinking",
        choices=(WAITS, REAL_TIME),
        default=usual.thinking,
        help="whether simulated time waits for answers of models and servers (default), or continues",
    )
    command.add_argument("--frames", action="store_true", help="send images of the house to models and servers, too")


def read_queries(arguments: argparse.Namespace, folder: str | os.PathLike[str] = "") -> Queries:
    """Return the queries of the options of `add_queries`; `folder` is that of their log and budget."""
    names = ("max_calls", "max_tokens", "patience", "thinking", "frames")
    said = {name: getattr(arguments, name) for name in names}
    queries = Queries(arguments.base_url or "", folder=os.fspath(folder), **said)
    queries.check()
    return queries


def add_embodiment(command: argparse.ArgumentParser) -> None:
    """Add the option for the robot."""
    robots = f"the robot in the house: {', '.join(EMBODIMENTS)}, or yours as module:object"
    command.add_argument("--embodiment", default=DEFAULT, metavar="NAME", help=robots)


def houses() -> str:
    """Return the valid houses, for help."""
    generated = "house-SEED, home-SEED, SHAPE-SEED, SET/I (such as test-100/17)"
    return f"{', '.join(floor_plan.house_names())}, {generated}, or a text file"


def caregivers() -> str:
    """Return the valid caregivers, for help."""
    return (
        f"{' '.join(dict.fromkeys([*CAREGIVERS, *POLICIES]))}, http://ADDRESS or chat:MODEL, or yours as module:object"
    )


def add_seed(command: argparse.ArgumentParser, text: str = "seed of all randomness") -> None:
    """Add the option for the seed, with a help text."""
    command.add_argument("--seed", type=int, default=0, help=text)


def add_executor(command: argparse.ArgumentParser) -> None:
    """Add the options for workers, for `make_executor`."""
    command.add_argument("--jobs", type=int, metavar="N", help="number of worker processes (default: 1)")
    command.add_argument(
        "--executor", choices=EXECUTORS, default="local", help="where jobs run: on this machine, or on a Dask cluster"
    )
    command.add_argument(
        "--scheduler", metavar="ADDRESS", help="address of the cluster's scheduler, such as tcp://10.0.0.1:8786"
    )


def make_executor(arguments: argparse.Namespace) -> Executor:
    """Return the executor of the options of `add_executor`.

    Raises:
        CaregiverError: The options are inconsistent, or the cluster cannot be used.
    """
    if arguments.executor == "local":
        if arguments.scheduler is not None:
            raise CaregiverError("--scheduler requires --executor dask")
        return LocalExecutor(1 if arguments.jobs is None else arguments.jobs)
    if arguments.scheduler is None:
        raise CaregiverError("--executor dask requires --scheduler ADDRESS, as `dask scheduler` prints it")
    if arguments.jobs is not None:
        raise CaregiverError("--jobs must be left out with --executor dask: a cluster has as many workers as it has")
    from caregiver_mj.experiments.cluster import DaskExecutor  # takes a second to import

    executor = DaskExecutor(arguments.scheduler)
    for name in ("distributed", "distributed.client"):  # errors are reported in one line instead
        logging.getLogger(name).setLevel(logging.CRITICAL)
    return executor


def add_children(command: argparse.ArgumentParser) -> None:
    """Add the options for the children except --epsilon, for `read_family`."""
    command.add_argument(
        "--children",
        type=int,
        metavar="K",
        help="number of children: a single epsilon then applies to each, and a list must have K",
    )
    command.add_argument(
        "--child",
        default=NOVICE,
        metavar="NAME",
        help=f"behaviour of children without a name in --epsilon: {' '.join(CHILDREN)}, or yours as module:object",
    )
    command.add_argument(
        "--child-speed",
        type=float,
        default=WALKING_SPEED,
        metavar="M_PER_S",
        help="speed of children: toddlers 0.25 to 0.8 (default: 1.6 km/h)",
    )


def read_family(epsilon: str, arguments: argparse.Namespace) -> ChildGroup:
    """Return the children of a value of --epsilon, such as "0.5" or "1,.25", and of the options of `add_children`.

    Raises:
        CaregiverError: The text is invalid, or its length differs from --children.
    """
    count = arguments.children
    if count is not None and count < 1:
        raise CaregiverError(f"--children must be at least 1, got {count}")
    name, _, share = arguments.child.rpartition(":")
    if name in CHILDREN and not share.isidentifier():  # no object of a module with that name
        raise CaregiverError(
            f"--child must be a name alone, got {arguments.child}: use --epsilon {name}:{share or 0.5}"
        )
    CHILDREN[arguments.child]  # raises for an unknown name, even if --epsilon names all children
    try:
        family = ChildGroup.parse(epsilon, arguments.child)
    except CaregiverError as error:
        raise CaregiverError(f"--epsilon {epsilon}: {error}") from None
    if count in (None, len(family)):
        return family
    if len(family) > 1:
        raise CaregiverError(
            f"--epsilon must be of --children {count}, got {epsilon}, which is of {len(family)} children"
        )
    return family.times(count)


def add_answers(command: argparse.ArgumentParser, does: str) -> None:
    """Add the options for a replay, for `read_answers`; `does` is the verb of the help text."""
    command.add_argument("--answers", metavar="DIR", help=f"run in the house, to {does} what --caregiver did in it")
    add_trust(command)


def add_trust(command: argparse.ArgumentParser) -> None:
    """Add the option to run code that a file names."""
    command.add_argument(
        "--trust",
        action="store_true",
        help="also run code that the files name outside the package and installed plug-ins: module:object, servers",
    )


def read_answers(arguments: argparse.Namespace) -> tuple[str, ...]:
    """Set the other options from the run in --answers, and return its caregiver's answers in each episode.

    Raises:
        CaregiverError: There is no suitable run, or it lacks the answers.
    """
    if arguments.answers is None:
        return ()
    from caregiver_mj.experiments.finished import best_rescue, read_finished  # need pandas, a second to import

    found = read_finished(arguments.answers)
    run = found.settings
    if not arguments.trust:
        run.check_installed()
    (plan, *more), (family, *others) = run.plans, run.families
    blocks = [block for block in run.blocks() if block.caregiver == arguments.caregiver]
    is_usual = run.world == "house" and run.task == SUPERVISE and not run.options
    wanted = "of one floor plan and epsilon "
    if vars(arguments).get("episode") == BEST:
        wanted, more, others = "", [], []
        if is_usual:
            plan, family, arguments.episode = best_rescue(found, arguments.caregiver)
    blocks = [block for block in blocks if run.house_of(block) == plan and block.families == (family,)]
    results = (read_block(found.path, str(block)) or {} for block in blocks)
    answers = tuple(text for result in results if isinstance(text := result.get("answers"), str) and text)
    if more or others or not is_usual or not answers or len(answers) < len(blocks):
        raise CaregiverError(
            f"--answers must be a run {wanted}in the house, with answers of '{arguments.caregiver}', got "
            f"'{arguments.answers}'"
        )
    arguments.house, arguments.damage, arguments.epsilon = plan, str(plan.damage), str(family)
    arguments.task, arguments.child, arguments.children = SUPERVISE, NOVICE, None
    for name in ("seed", "embodiment", "sight", "child_speed"):
        setattr(arguments, name, getattr(run, name))
    return answers


def warn_of_no_room(plan: FloorPlan) -> None:
    """Print a warning to standard error if the robot cannot do all its work in a house."""
    try:
        check_starts(plan)
        wrong = "" if is_drivable(plan) else f"the robot has no room to get to all that it needs in {plan.name}"
    except CaregiverError as error:
        wrong = f"for the grid only: in MuJoCo, {error}"
    if wrong:
        print(f"{PROGRAM}: warning: {plain(wrong)}", file=sys.stderr)


def broken_off(
    error: BaseException, done: int, total: int, folder: str | os.PathLike[str], arguments: argparse.Namespace
) -> StorageError:
    """Return an error that says how to resume a run with stored episodes."""
    again = arguments.argv if arguments.resume else [*arguments.argv, "--resume"]
    return StorageError(
        f"{str(error) or 'interrupted'}; {done} of {total} episodes are kept in '{folder}', "
        f"go on with: {PROGRAM} {shlex.join(again)}"
    )
