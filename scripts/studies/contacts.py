"""What the robot does to the child by touch, and with the candle in its hand: in whole episodes of several houses.

Beside each other: strikes as ever, by the robot's speed towards the child, and by that of its surface, turning and
sliding too; strikes and pressings by who moved; pressings by the part of the robot; forces, with what adults bear; how
close flame and wax come; which skill took longest; and how close the robot came to its limits, if that is asked for.
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import dataclasses
import functools
import json
import time
from collections.abc import Iterable
from typing import Any, NamedTuple

import pandas as pd

from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.spec import episode_random, episode_seed
from caregiver_mj.experiments.workers import run_jobs
from caregiver_mj.house.physics import Physics
from caregiver_mj.house.sensing import Sensing
from caregiver_mj.outside import parse_json
from caregiver_mj.plans.hazards import NOTHING
from caregiver_mj.plans.sets import houses_named
from caregiver_mj.policy.policy import CaregiverPolicy
from caregiver_mj.recording.ledger import STRIKE_SPEED, Contacts, Touch
from caregiver_mj.robot.skills import Skill
from caregiver_mj.robot.status import Status
from caregiver_mj.tasks import load
from caregiver_mj.viz.report.tables import counts_table, limits_table
from caregiver_mj.viz.report.words import Table, family_name
from studies.audit import Audit, Recorder, report
from study import Parser, make_console, progress

PARTS = ("base", "arm", "hand")
MOVES = 0.01  # m/s of the robot's surface, towards a child or along it, above which it is the robot that moves
_APART = 0.1  # seconds without touch after which a contact is another one


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("caregiver", "expected-danger", "who protects the children")
    parser.add("houses", ["train-5"], "houses to run in")
    parser.add("epsilon", ["0.5", "adversary:0"], "children")
    parser.add("episodes", 2, "episodes for each in each house")
    parser.add_file("out", "write their rows there as they come; those that it holds are not run again", "FILE.jsonl")
    parser.add("embodiment", [None], "the robots (default: the task's)", metavar="NAME")
    parser.add("compliant", False, "children that give way to a push")
    example = '{"delay": 0.06, "base": {"noise": 0.005}}'
    parser.add("sensing", None, f"how things are seen, such as '{example}'", type=_sensing, metavar="JSON")
    parser.add("audit", 0, "audit every K-th episode; 0 for none", metavar="K")
    parser.add_jobs()


def _sensing(text: str) -> str:
    """Return the option's text, if it says how things are seen."""
    try:
        Sensing.of(parse_json(text))
    except (ValueError, CaregiverError) as error:
        raise argparse.ArgumentTypeError(f"sensing must be a dictionary in JSON, got '{text}': {error}") from error
    return text


def run(options: argparse.Namespace) -> None:
    """Run the study; print its tables, and a line that sums them up."""
    rows, ratios = episodes_of(options), []
    for robot, episodes in rows.groupby("embodiment", sort=False, dropna=False):
        if len(options.embodiment) > 1:
            print(f"## {robot}\n")
        print(page(episodes, options.compliant))
        print(presses_table(episodes).markdown())
        print(f"Strikes by a robot that stood, and that a child pushed: {episodes.strikes_pushed.sum():.0f}.")
        print(longest_skill(episodes))
        if audit := audit_of(episodes):
            report(make_console(), audit)
            name = robot if len(options.embodiment) > 1 else "the robot"
            ratios.append(f"; {name} came to {audit.worst_ratio:.3f} of its limits")
    print(summary(rows) + "".join(ratios))


class Job(NamedTuple):
    """An episode to run, that of `evaluate` with the same caregiver, house, family and number."""

    embodiment: str | None
    caregiver: str
    compliant: bool
    house: str
    family: str
    episode: int
    sensing: str | None = None


@dataclasses.dataclass
class _Touching:
    """A contact of a child with the robot: how often each part was touched at the end of a control timestep."""

    since: Contacts
    parts: collections.Counter[str]


class Presses:
    """Counts pressings by the part of the robot that is touched most, and by whether it has moved meanwhile.

    Attributes:
        counts: How many have begun, by "base", "base, moving" and so on.
    """

    def __init__(self, children: int) -> None:
        self.counts = dict.fromkeys((part + how for part in PARTS for how in ("", ", moving")), 0)
        self._touching = [_Touching(Contacts(), collections.Counter()) for _ in range(children)]
        self._touched_at = [0.0] * children

    def look(self, physics: Physics) -> None:
        """Take in what the children have touched in the last control timestep."""
        for child in range(len(self._touching)):
            touches = [touch for touch in physics.touches if touch.child == child and touch.kind == "robot"]
            if not touches:
                continue
            if touches[0].time - self._touched_at[child] > _APART:
                self._touching[child] = _Touching(Contacts(), collections.Counter())
            now, self._touched_at[child] = self._touching[child], touches[-1].time
            now.parts.update(_touched(physics, child))
            before = now.since.pressings
            now.since.take_in(touches, physics.timestep(), physics.time())
            if now.since.pressings > before:
                how = ", moving" if now.since.contact_speed > MOVES else ""
                self.counts[max(PARTS, key=now.parts.__getitem__) + how] += 1


def is_pushed(touches: Iterable[Touch]) -> bool:
    """Return whether a robot that strikes a child stands as far as its drives go: then a child pushes it."""
    fast = [touch for touch in touches if touch.speed > STRIKE_SPEED]
    return all(touch.kind == "robot" and touch.driven_speed < MOVES for touch in fast)


def _touched(physics: Physics, child: int) -> set[str]:
    """Return the parts of the robot that a child touches now."""
    model, reader, found = physics.model.ptr, physics.touch_reader, set()
    for pair in physics.data.contact.geom.tolist():
        if reader.bodies[child] in pair:
            body = model.geom_bodyid[sum(pair) - reader.bodies[child]]
            below = [body]
            while below[-1]:
                below.append(model.body_parentid[below[-1]])
            if reader.robot and reader.robot.base_body in below:
                is_hand = any(model.body(one).name == "robot/hand" for one in below)
                found.add("hand" if is_hand else "base" if body == reader.robot.base_body else "arm")
    return found


class Longest:
    """The longest time that the robot spent on one skill until that was done.

    Attributes:
        skill: Name of the skill.
        seconds: The time, s.
    """

    def __init__(self) -> None:
        self.skill, self.seconds = "", 0.0
        self._now: Skill | None = None
        self._since = 0.0

    def look(self, policy: CaregiverPolicy, now: float) -> None:
        """Observe the present skill, `now` seconds after the start of the episode."""
        routine = policy.executive.routine
        skill = routine.skill if routine and policy.target != NOTHING else None
        if skill is not self._now or (skill and skill.status is Status.DONE):
            self._now, self._since = skill, now
        elif skill and now - self._since > self.seconds:
            self.skill, self.seconds = type(skill).__name__, now - self._since


def supervise(audited: frozenset[Job], job: Job) -> dict[str, Any]:
    """Run one episode, and audits it if it is one of these; returns its row."""
    (plan,) = houses_named([job.house])
    sensing = json.loads(job.sensing) if job.sensing else None
    kwargs = {"compliant_children": job.compliant, "embodiment": job.embodiment, "sensing": sensing}
    env = load("supervise", plan, ChildGroup.parse(job.family), episode_random(0), task_kwargs=kwargs, visuals=False)
    policy, seed, longest = CaregiverPolicy(env, job.caregiver), episode_seed(0, job.episode), Longest()
    presses = Presses(len(ChildGroup.parse(job.family)))
    env.task.reseed(episode_random(seed))
    start, timestep, pushed = time.process_time(), env.reset(), 0
    with Recorder(env) if job in audited else contextlib.nullcontext() as recorder:
        while not timestep.last():
            before, timestep = env.task.strikes, env.step(policy(timestep))
            pushed += (env.task.strikes - before) * is_pushed(env.physics.touches)
            longest.look(policy, env.physics.time())
            presses.look(env.physics)
    row = {name: getattr(job, name) for name in Job.__annotations__} | {"seed": seed} | env.task.outcome()
    row |= {"skill": longest.skill, "skill_seconds": longest.seconds, **presses.counts, "strikes_pushed": pushed}
    if recorder:
        name = f"{job.house} {job.family} {job.episode}"
        row["audit"] = dataclasses.asdict(Audit.of(recorder.log(), job.embodiment, name))
    return row | {"cpu_seconds": time.process_time() - start, "sim_seconds": env.physics.time()}


def episodes_of(options: argparse.Namespace) -> pd.DataFrame:
    """The episodes that the options say; those whose rows are there already are not run again."""
    houses = [plan.name for plan in houses_named(options.houses)]
    families = [str(ChildGroup.parse(family)) for family in options.epsilon]
    jobs = [
        Job(robot, options.caregiver, options.compliant, house, family, episode, options.sensing)
        for robot in options.embodiment
        for house in houses
        for family in families
        for episode in range(options.episodes)
    ]
    rows: dict[Job, dict[str, Any]] = {}
    if options.out and options.out.exists():
        for line in options.out.read_text(encoding="utf-8").splitlines():
            row = json.loads(line)
            if "strikes_pushed" in row:  # else an older version counted less, and it is run again
                rows[Job(*(row.get(name) for name in Job.__annotations__))] = row
    left = [job for job in jobs if job not in rows]
    work = functools.partial(supervise, frozenset(jobs[:: options.audit] if options.audit else ()))
    running = progress(run_jobs(work, left, options.jobs), "in the house", len(left))
    with open(options.out, "a", encoding="utf-8") if options.out else contextlib.nullcontext() as file:
        for job, row in running:
            rows[job] = row
            if file:
                print(json.dumps(row, default=float), file=file, flush=True)
    return pd.DataFrame([rows[job] for job in jobs])


def page(episodes: pd.DataFrame, compliant: bool = False) -> str:
    """The tables, in Markdown."""
    groups = {family_name(family): group for family, group in episodes.groupby("family", sort=False)}
    if len(groups) > 1:
        groups["all"] = episodes
    return f"{counts_table(groups).markdown()}\n{limits_table(episodes, compliant=compliant).markdown()}"


def summary(episodes: pd.DataFrame) -> str:
    """Return what came out in a line."""
    strikes, pushed, stricter, drops = (
        f"{episodes[name].sum():.0f}" for name in ("strikes", "strikes_pushed", "strikes_surface", "candles_dropped")
    )
    return (
        f"{len(episodes)} episodes: {strikes} strikes, {pushed} of them pushed; {stricter} by the stricter count; "
        f"{drops} drops; contact {episodes.contact_seconds.mean():.2f} s an episode; flame at least "
        f"{episodes.flame_distance.min():.2f} m; greatest force {episodes.contact_force.max():.0f} N"
    )


def presses_table(episodes: pd.DataFrame) -> Table:
    """The pressings of some episodes by the part of the robot, and by who moved."""
    rows = [(part, *(f"{episodes[part + how].sum():.0f}" for how in ("", ", moving"))) for part in PARTS]
    note = (
        f"The robot moves if its surface came towards the child, or slid along it, faster than {MOVES:g} m/s at any "
        "time since they touched; else the child leans on a robot that stands. Of several parts that which was touched "
        "for longest counts."
    )
    return Table("Pressings by part and by who moved", ("part of the robot", "child alone", "robot too"), rows, note)


def longest_skill(episodes: pd.DataFrame) -> str:
    """Return a sentence on the longest skill of some episodes."""
    row = episodes.loc[episodes.skill_seconds.idxmax()]
    return f"Longest skill: {row.skill_seconds:.1f} s, {row.skill} ({row.house}, {row.family}, episode {row.episode})."


def audit_of(episodes: pd.DataFrame) -> Audit | None:
    """The worst of the audits of some episodes; None if none of them was audited."""
    found = episodes.audit.dropna() if "audit" in episodes else ()
    return Audit.worst_of([Audit.of_dict(audit) for audit in found]) if len(found) else None
