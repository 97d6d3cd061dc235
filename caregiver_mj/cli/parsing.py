"""Options that several commands have."""

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
CAREGIVER = RULE[0]  # that acts in all commands unless another one is named


def _add_house(command: argparse._ActionsContainer) -> None:
    command.add_argument("--house", default="paper", metavar="NAME|FILE", help=houses())


def _add_damage(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--damage",
        default=str(DamageWeights()),
        metavar="KIND=D,...",
        help=f"what a collision costs, of {', '.join(DamageWeights())}: stairwell=5,mug=5, or 5:4:1 of the first three",
    )


def read_house(arguments: argparse.Namespace) -> FloorPlan:
    """Return the house that `add_who`'s options say, or that of --answers."""
    if isinstance(arguments.house, FloorPlan):
        return arguments.house
    return FloorPlan.load(arguments.house, damage=arguments.damage)


def add_houses(command: argparse.ArgumentParser) -> None:
    """Add the options that say which houses they are, for `read_houses`."""
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
    """Return the houses that `add_houses`'s options say."""
    if arguments.houses is None:
        return (read_house(arguments),)
    return houses_named(arguments.houses, arguments.damage)


def add_who(command: argparse.ArgumentParser, others: str = "") -> None:
    """Add which house it is, which children are there, and who takes care of them; `others` may do so, too."""
    _add_house(command)
    _add_damage(command)
    command.add_argument(
        "--epsilon",
        default="0.5",
        metavar="E[,E...]",
        help="share of random moves; of several children one each, such as 1,.25",
    )
    add_children(command)
    command.add_argument("--caregiver", default=CAREGIVER, metavar="NAME", help=f"{others}{caregivers()}")
    add_embodiment(command)


def read_spec(arguments: argparse.Namespace, **more: Any) -> EpisodeSpec:
    """Return the episode that `add_who`'s, `add_episode`'s and `add_queries`'s options say, with more fields of it."""
    plan, house = read_house(arguments), arguments.house
    fields = {name: getattr(arguments, name) for name in ("seed", "episode", "sight", "task") if name in arguments}
    return EpisodeSpec(
        plan,
        read_family(arguments.epsilon, arguments),
        arguments.caregiver,
        embodiment=arguments.embodiment,
        file="" if isinstance(house, FloorPlan) or house == plan.name else house,
        queries=read_queries(arguments),
        **fields | more,
    )


def add_episode(command: argparse.ArgumentParser) -> None:
    """Add the options that say which episode of which run it is."""
    add_seed(command, "seed of the run that the episode belongs to")
    command.add_argument("--episode", type=int, default=0, metavar="N", help="number of the episode in that run")
    add_sight(command)


def add_sight(command: argparse.ArgumentParser) -> None:
    """Add what the caregiver sees."""
    command.add_argument("--sight", default="all", help="what the caregiver sees: all, walls, camera or rooms:N")


def add_queries(command: argparse.ArgumentParser) -> None:
    """Add how caregivers elsewhere are asked, for `read_queries`."""
    usual, until = Queries(), "of the run, also when it is resumed; then they abstain"
    command.add_argument("--base-url", metavar="URL", help="where chat:MODEL is; its key is in OPENAI_API_KEY")
    command.add_argument("--max-calls", type=int, metavar="N", help=f"requests to models and servers {until}")
    command.add_argument("--max-tokens", type=int, metavar="N", help=f"tokens of models {until}")
    command.add_argument(
        "--patience", type=float, default=usual.patience, metavar="S", help="seconds for an answer of theirs"
    )
    command.add_argument(
        "--thinking",
        choices=(WAITS, REAL_TIME),
        default=usual.thinking,
        help="whether time waits until models and servers answer (default), or goes on",
    )
    command.add_argument("--frames", action="store_true", help="models and servers get pictures of the house, too")


def read_queries(arguments: argparse.Namespace, folder: str | os.PathLike[str] = "") -> Queries:
    """Return what `add_queries`'s options say; exchanges are kept, and counted, in a folder if there is one."""
    names = ("max_calls", "max_tokens", "patience", "thinking", "frames")
    said = {name: getattr(arguments, name) for name in names}
    queries = Queries(arguments.base_url or "", folder=os.fspath(folder), **said)
    queries.check()
    return queries


def add_embodiment(command: argparse.ArgumentParser) -> None:
    """Add which robot it is."""
    robots = f"the robot in the house: {', '.join(EMBODIMENTS)}, or yours as module:object"
    command.add_argument("--embodiment", default=DEFAULT, metavar="NAME", help=robots)


def houses() -> str:
    """Return what may be said for a house."""
    generated = "house-SEED, home-SEED, SHAPE-SEED, SET/I (such as test-100/17)"
    return f"{', '.join(floor_plan.house_names())}, {generated}, or a text file"


def caregivers() -> str:
    """Return what may be said for a caregiver."""
    return (
        f"{' '.join(dict.fromkeys([*CAREGIVERS, *POLICIES]))}, http://ADDRESS or chat:MODEL, or yours as module:object"
    )


def add_seed(command: argparse.ArgumentParser, text: str = "all chance comes from it") -> None:
    """Add the seed, and say what it is of."""
    command.add_argument("--seed", type=int, default=0, help=text)


def add_executor(command: argparse.ArgumentParser) -> None:
    """Add the options that say where the work is done, for `make_executor`."""
    command.add_argument("--jobs", type=int, metavar="N", help="number of worker processes (default: 1)")
    command.add_argument(
        "--executor", choices=EXECUTORS, default="local", help="where jobs run: on this machine, or on a Dask cluster"
    )
    command.add_argument(
        "--scheduler", metavar="ADDRESS", help="address of the cluster's scheduler, such as tcp://10.0.0.1:8786"
    )


def make_executor(arguments: argparse.Namespace) -> Executor:
    """Return what `add_executor`'s options say.

    Raises:
        CaregiverError: They do not fit together, or the cluster cannot be worked with.
    """
    if arguments.executor == "local":
        if arguments.scheduler is not None:
            raise CaregiverError("--scheduler must be with --executor dask")
        return LocalExecutor(1 if arguments.jobs is None else arguments.jobs)
    if arguments.scheduler is None:
        raise CaregiverError("--executor dask must be with --scheduler ADDRESS, as `dask scheduler` prints it")
    if arguments.jobs is not None:
        raise CaregiverError("--jobs must be left out with --executor dask: a cluster has as many workers as it has")
    from caregiver_mj.experiments.cluster import DaskExecutor  # here, for it takes a second to import

    executor = DaskExecutor(arguments.scheduler)
    for name in ("distributed", "distributed.client"):  # what goes wrong we say ourselves, in one line
        logging.getLogger(name).setLevel(logging.CRITICAL)
    return executor


def add_children(command: argparse.ArgumentParser) -> None:
    """Add the options that say who the children are, for `read_family`, save --epsilon itself."""
    command.add_argument(
        "--children",
        type=int,
        metavar="K",
        help="number of children: a single epsilon is then that of each, and a list must have K",
    )
    command.add_argument(
        "--child",
        default=NOVICE,
        metavar="NAME",
        help=f"what decides a child's moves, where --epsilon has no name before it: "
        f"{' '.join(CHILDREN)}, or yours as module:object",
    )


def read_family(epsilon: str, arguments: argparse.Namespace) -> ChildGroup:
    """Return the children of one value of --epsilon, such as "0.5" or "1,.25", and of `add_children`'s options.

    Raises:
        CaregiverError: There can be no such children, or the list is not as long as --children says.
    """
    count = arguments.children
    if count is not None and count < 1:
        raise CaregiverError(f"--children must be at least 1, got {count}")
    name, _, share = arguments.child.rpartition(":")
    if name in CHILDREN and not share.isidentifier():  # as an object in a module of that name would be
        raise CaregiverError(
            f"--child must be a name alone, got {arguments.child}: use --epsilon {name}:{share or 0.5}"
        )
    CHILDREN[arguments.child]  # there may be none, which counts for nothing where all have names
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
    """Add the options that say whose answers to give again, for `read_answers`."""
    command.add_argument("--answers", metavar="DIR", help=f"a run of one house, to {does} what --caregiver did in it")
    add_trust(command)


def add_trust(command: argparse.ArgumentParser) -> None:
    """Add the option that has code run which a file names."""
    command.add_argument(
        "--trust",
        action="store_true",
        help="run what the files name beside the package's own and installed plug-ins: module:object, servers",
    )


def read_answers(arguments: argparse.Namespace) -> tuple[str, ...]:
    """Take all that makes an episode from --answers; return what the run's caregiver has answered in each.

    Raises:
        CaregiverError: There is no such run, or it has no such answers.
    """
    if arguments.answers is None:
        return ()
    from caregiver_mj.experiments.finished import read_finished  # needs pandas, a second to import

    found = read_finished(arguments.answers)
    run = found.settings
    if not arguments.trust:
        run.check_installed()
    (plan, *more), (family, *others) = run.plans, run.families
    blocks = [block for block in run.blocks() if block.caregiver == arguments.caregiver]
    results = (read_block(found.path, str(block)) or {} for block in blocks)
    answers = tuple(text for result in results if isinstance(text := result.get("answers"), str) and text)
    is_usual = run.world == "house" and run.task == SUPERVISE and not run.options
    if more or others or not is_usual or not answers or len(answers) < len(blocks):
        raise CaregiverError(
            f"--answers must be a run of one house, not of the grid, with one epsilon, and answers of "
            f"'{arguments.caregiver}', got '{arguments.answers}'"
        )
    arguments.house, arguments.damage, arguments.epsilon = plan, str(plan.damage), str(family)
    arguments.task, arguments.child, arguments.children = SUPERVISE, NOVICE, None
    arguments.seed, arguments.embodiment, arguments.sight = run.seed, run.embodiment, run.sight
    return answers


def warn_of_no_room(plan: FloorPlan) -> None:
    """Write a line to standard error if the robot cannot do all of its work in a house."""
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
    """Return what to raise where episodes that are done are kept: it says how to go on."""
    again = arguments.argv if arguments.resume else [*arguments.argv, "--resume"]
    return StorageError(
        f"{str(error) or 'interrupted'}; {done} of {total} episodes are kept in '{folder}', "
        f"go on with: {PROGRAM} {shlex.join(again)}"
    )
