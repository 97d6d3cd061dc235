"""Options shared by several commands, and the objects that they describe."""

from __future__ import annotations

import argparse
import dataclasses
import functools
import logging
import os
import re
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
from caregiver_mj.experiments.workers import DaskExecutor, Executor, LocalExecutor
from caregiver_mj.outside import plain
from caregiver_mj.plans import floor_plan
from caregiver_mj.plans.floor_plan import FloorPlan, check_starts
from caregiver_mj.plans.generator import is_drivable
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.plans.sets import SETS
from caregiver_mj.robot.embodiment import DEFAULT
from caregiver_mj.robot.embodiments import EMBODIMENTS

BEST = "best"  # stands for the number of an episode
CAREGIVER = RULE[0]  # default of all commands
ONE_CAREGIVER = "caregiver or policy (see `list caregivers` and `evaluate --help`)"  # help
# Options that belong together, for `add`.
CHILDREN_OPTIONS = ("--children", "--child", "--child-speed")  # without --epsilon, for `read_family`
QUERIES = ("--base-url", "--max-calls", "--max-tokens", "--patience", "--thinking", "--frames")  # for `read_queries`
WORKERS = ("--jobs", "--executor", "--scheduler")  # for `make_executor`
WHERE = ("--house", "--damage", "--epsilon", *CHILDREN_OPTIONS)  # house and children, for `read_spec`
_OF_RUN = (*WHERE, "--embodiment", "--seed", "--sight", "--task", "--world", *QUERIES)  # what --answers decides


def add(command: argparse._ActionsContainer, *names: str, **changed: Any) -> None:
    """Add options by their names, with some of their keywords changed."""
    known = _options()
    for name in names:
        command.add_argument(name, **known[name] | changed)


@functools.cache
def _options() -> dict[str, dict[str, Any]]:
    """Return the keywords of `add_argument` for every option."""

    def of(text: str, **keywords: Any) -> dict[str, Any]:
        return {"help": text, **keywords}

    yours, until = "or yours as module:object", "resumed runs included; then they abstain"
    damage = f"damage of collisions with {', '.join(DamageWeights())}: stairwell=5,mug=5, or 5:4:1 for the first three"
    sets = f"several houses: {', '.join(SETS)} (see `list sets`), or names and files"
    several = "number of children; each has the epsilon given, or a list has K values"
    behaviours = f"behaviour of children without a name in --epsilon: {' '.join(CHILDREN)}, {yours}"
    thinking = "whether simulated time waits for answers of models and servers (default), or continues"
    strangers = "also run code (module:object) and query servers that the files name"
    queries = Queries()
    return {
        "--house": of(houses(), default="paper", metavar="NAME|FILE"),
        "--houses": of(sets, nargs="+", metavar="SET|NAME"),
        "--damage": of(damage, default=str(DamageWeights()), metavar="KIND=D,..."),
        "--epsilon": of(
            "share of random moves; for several children one each, such as 1,.25", default="0.5", metavar="E[,E...]"
        ),
        "--children": of(several, type=int, metavar="K"),
        "--child": of(behaviours, default=NOVICE, metavar="NAME"),
        "--child-speed": of(
            "speed of children: toddlers 0.25 to 0.8 (default: 1.6 km/h)",
            type=float, default=WALKING_SPEED, metavar="M_PER_S",
        ),
        "--caregiver": of(ONE_CAREGIVER, default=CAREGIVER, metavar="NAME"),
        "--embodiment": of(
            f"the robot in the house: {', '.join(EMBODIMENTS)}, {yours}", default=DEFAULT, metavar="NAME"
        ),
        "--seed": of("seed of all randomness", type=int, default=0),
        "--episode": of("number of the episode in that run", type=int, default=0, metavar="N"),
        "--sight": of("what the caregiver sees: all, walls, camera or rooms:N", default="all"),
        "--base-url": of("address of chat:MODEL; its key is in OPENAI_API_KEY", metavar="URL"),
        "--max-calls": of(f"most requests to models and servers, {until}", type=int, metavar="N"),
        "--max-tokens": of(f"most tokens of models, {until}", type=int, metavar="N"),
        "--patience": of(
            "seconds for an answer of a model or server", type=float, default=queries.patience, metavar="S"
        ),
        "--thinking": of(thinking, choices=(WAITS, REAL_TIME), default=queries.thinking),
        "--frames": of("send images of the house to models and servers, too", action="store_true"),
        "--jobs": of("number of worker processes (default: 1)", type=int, metavar="N"),
        "--executor": of(
            "where jobs run: on this machine, or on a Dask cluster", choices=("local", "dask"), default="local"
        ),
        "--scheduler": of("address of the cluster's scheduler, such as tcp://10.0.0.1:8786", metavar="ADDRESS"),
        "--json": of("print the table as JSON only", action="store_true"),
        "--answers": of("", metavar="DIR"),
        "--trust": of(strangers, action="store_true"),
    }  # fmt: skip


def houses() -> str:
    """Return the valid houses, for help."""
    generated = "house-SEED, home-SEED, SHAPE-SEED, SET/I (such as test-100/17)"
    return f"{', '.join(floor_plan.house_names())}, {generated}, or a text file"


def caregivers() -> str:
    """Return the valid caregivers, for help."""
    names = dict.fromkeys([*CAREGIVERS, *POLICIES])
    return f"{' '.join(names)}, attentive:SHARE[:NAME], http://ADDRESS or chat:MODEL, or yours as module:object"


def number_or_best(text: str) -> int | str:
    """Return the value of an --episode that may be `BEST`."""
    try:
        return text if text == BEST else int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be a number or {BEST}, got '{text}'") from None


def read_size(text: str, option: str, example: str) -> tuple[int, int]:
    """Return width and height of an option such as WxH."""
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    if match is None:
        raise CaregiverError(f"{option} must be WxH, such as {example}, got '{text}'")
    return int(match[1]), int(match[2])


def read_spec(arguments: argparse.Namespace, **more: Any) -> EpisodeSpec:
    """Return the episode of the options, with further fields."""
    plan = FloorPlan.load(arguments.house, damage=arguments.damage)
    names = ("seed", "episode", "sight", "task", "child_speed")
    fields = {name: getattr(arguments, name) for name in names if name in arguments}
    return EpisodeSpec(
        plan,
        read_family(arguments.epsilon, arguments),
        arguments.caregiver,
        embodiment=arguments.embodiment,
        file="" if arguments.house == plan.name else arguments.house,
        queries=read_queries(arguments),
        **fields | more,
    )


def read_queries(arguments: argparse.Namespace, folder: str | os.PathLike[str] = "") -> Queries:
    """Return the queries of the options `QUERIES`; `folder` is that of their log and budget.

    Raises:
        CaregiverError: An option is invalid, or without effect on the caregivers.
    """
    names = ("max_calls", "max_tokens", "patience", "thinking", "frames")
    said = {name: getattr(arguments, name) for name in names}
    queries = Queries(arguments.base_url or "", folder=os.fspath(folder), **said)
    queries.check()
    caregivers = [arguments.caregiver] if isinstance(arguments.caregiver, str) else arguments.caregiver
    used = queries.for_caregivers(caregivers)
    for name in ("base_url", *names):
        if getattr(queries, name) not in (getattr(Queries, name), getattr(used, name)):
            who = "chat:MODEL" if name == "base_url" else "http://ADDRESS or chat:MODEL"
            raise CaregiverError(
                f"--{name.replace('_', '-')} requires caregiver {who}, which asks a server, got {' '.join(caregivers)}"
            )
    return queries


def make_executor(arguments: argparse.Namespace) -> Executor:
    """Return the executor of the options `WORKERS`.

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
    executor = DaskExecutor(arguments.scheduler)
    for name in ("distributed", "distributed.client"):  # errors are reported in one line instead
        logging.getLogger(name).setLevel(logging.CRITICAL)
    return executor


def read_family(epsilon: str, arguments: argparse.Namespace) -> ChildGroup:
    """Return the children of a value of --epsilon, such as "0.5" or "1,.25", and of `CHILDREN_OPTIONS`.

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


def read_episode(arguments: argparse.Namespace, **more: Any) -> tuple[EpisodeSpec, tuple[str, ...]]:
    """Return the episode of the options, with further fields, and the caregiver's answers in each episode of --answers.

    With --answers, the episode is one of that run; without, there are no answers.

    Raises:
        CaregiverError: There is no suitable run, it lacks the answers, or there are options that the run decides.
    """
    if arguments.answers is None:
        return read_spec(arguments, **more), ()
    for given in {word.partition("=")[0]: None for word in arguments.argv}:
        if given in _OF_RUN:
            raise CaregiverError(f"{given} must be left out with --answers, whose run decides it")
    from caregiver_mj.experiments.finished import best_rescue, read_finished  # need pandas, a second to import

    found = read_finished(arguments.answers)
    run, number = found.settings, vars(arguments).get("episode", 0)
    if not arguments.trust:
        run.check_installed()
    (plan, *other_plans), (family, *other_families) = run.plans, run.families
    is_usual = run.world == "house" and run.task == SUPERVISE and not run.options
    wanted = "of one floor plan and epsilon "
    if number == BEST:
        wanted, other_plans, other_families = "", [], []
        if is_usual:
            plan, family, number = best_rescue(found, arguments.caregiver)
    blocks = [
        block
        for block in run.blocks()
        if (block.caregiver, run.house_of(block), block.families) == (arguments.caregiver, plan, (family,))
    ]
    results = (read_block(found.path, str(block)) or {} for block in blocks)
    answers = tuple(text for result in results if isinstance(text := result.get("answers"), str) and text)
    if other_plans or other_families or not is_usual or not answers or len(answers) < len(blocks):
        raise CaregiverError(
            f"--answers must be a run {wanted}in the house, with answers of '{arguments.caregiver}', got "
            f"'{arguments.answers}'"
        )
    spec = run.spec(plan, family, arguments.caregiver, number)
    return dataclasses.replace(spec, queries=Queries(), file="", **more), answers


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
