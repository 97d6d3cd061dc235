"""A run as one file that others can verify: its settings, its rows, and the caregivers' answers.

Verification replays the answers without a caregiver; every row must be equal bit for bit. This proves the results of
the answers, not their origin: a caregiver could have known the children's goals.
"""

from __future__ import annotations

import functools
import hashlib
import io
import json
import math
import os
import pathlib
import shlex
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from caregiver_mj import outside
from caregiver_mj.caregivers.answers import unpacked
from caregiver_mj.children.walk import WALKING_SPEED
from caregiver_mj.errors import CaregiverError, check_kind
from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.evaluation import Tables, belongs, sum_up, tables_of
from caregiver_mj.experiments.finished import read_finished
from caregiver_mj.experiments.intervals import Estimate
from caregiver_mj.experiments.provenance import difference, source_digest, versions
from caregiver_mj.experiments.run_folder import Result, extended_at, in_short, read_block, write_whole
from caregiver_mj.experiments.runner import MAPS, check_answers, run_block
from caregiver_mj.experiments.score import with_costs
from caregiver_mj.experiments.settings import GRID_BLOCK, Block, Settings
from caregiver_mj.experiments.spec import NOBODY, SUPERVISE
from caregiver_mj.experiments.summary import HOW, Harm, judge_run
from caregiver_mj.experiments.workers import Executor
from caregiver_mj.outside import markdown, parse_json, plain
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import KINDS
from caregiver_mj.plans.sets import packaged

SUFFIX = ".submission"
_CARD, _RUN, _SUMS = "card.json", "run.json", "sha256.json"
_PART = b"PK\1\2"  # start of a zip file's directory entries
_IN_CODE = str.maketrans({"|": "/", "`": "'"})  # characters that would end code in a table
_KEYS = {"rows", "maps", "answers"}  # keys of a block's result
_EVENTS = ("strikes", "candles_dropped")  # columns of the house only
_LEFT_ALIGNED = ("caregiver", "of", "by", "harm")  # columns
_RED = "**HARM**:"  # marks a row
_TIMES = ("wall_seconds",)  # columns that a replay does not reproduce
_HEAD = f"""# Leaderboard

Every row has come back, bit for bit, from its file, but for the seconds an episode, which its author's machine took.
Damage left: over that of `none`, with a 95 % interval over houses; also at each epsilon, and by kind of hazard, of all
damage of `none`. Toys kept: over those that children reach with `none`. Score: 0 as `none`, 1 with bare tables only;
damage, strikes and dropped things of the robot count against it.

Least damage left comes first, but a caregiver that does harm, by any of its three parts, stands below all that do not,
`none` among them: no damage avoided makes up for a child that is struck. {HOW}"""


class Submission(NamedTuple):
    """The content of a file."""

    path: pathlib.Path  # the file
    card: Mapping[str, str]  # `title`, `authors` and `notes` by the authors
    settings: Settings  # settings of the run
    results: Mapping[Block, Result]  # claimed result of each block


class _Claim(NamedTuple):
    """A block, and the answers of its caregiver."""

    block: Block
    answers: str

    def __str__(self) -> str:
        return str(self.block)


def submit(run: str | os.PathLike[str], path: str | os.PathLike[str], card: Mapping[str, str]) -> Settings:
    """Pack the finished run in a folder into `FILE.submission`, with a card by its authors; return its settings.

    Raises:
        CaregiverError: The run is unfinished or lacks the caregivers' answers, or the file exists or cannot be written.
    """
    found, path = read_finished(run), pathlib.Path(path)
    if path.suffix != SUFFIX:
        raise CaregiverError(f"the file must be called FILE{SUFFIX}, got '{path}'")
    if os.path.lexists(path):
        raise CaregiverError(f"the file must be a new one, got '{path}', which exists")
    if "pooled" in found.record:
        raise CaregiverError(f"the run in '{run}' must be one run, got several pooled: submit each of them")
    added = extended_at(found.record, found.settings.episodes)
    files: dict[str, Any] = {_CARD: dict(card), _RUN: found.record}
    for number, block in enumerate(found.settings.blocks(extended_at=added)):
        result = read_block(found.path, str(block))
        if result is None or not belongs(found.settings, block, result):
            raise CaregiverError(
                f"the run in '{run}' has lost episodes ({block}): `caregiver-mj evaluate --resume` runs them again"
            )
        if not result.get("answers") and block.caregiver not in NOBODY:
            raise CaregiverError(
                f"the run in '{run}' must have what '{block.caregiver}' answered, got nothing: one of an older version "
                "must be run again"
            )
        check_answers(block, result.get("answers", ""))
        files[_name(number)] = result
    texts = {name: json.dumps(content, allow_nan=False) for name, content in files.items()}
    sums = {name: _digest(text) for name, text in texts.items()}
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, text in {**texts, _SUMS: json.dumps(sums)}.items():
            packed.writestr(zipfile.ZipInfo(name), text, zipfile.ZIP_DEFLATED)  # without times, so reproducible
        try:  # the reader's limits
            _check_size(packed, content.tell())
        except ValueError as error:
            raise CaregiverError(f"the run in '{run}' is too large for one file: {error}") from None
    try:
        write_whole(path, content.getvalue())
    except OSError as error:  # of a folder that is a file, or of a name that is too long
        raise CaregiverError(f"'{plain(path)}' cannot be written: {error.strerror}") from None
    return found.settings


def read_submission(path: str | os.PathLike[str], *, trust: bool = False) -> Submission:
    """Read a file to verify, which may be a stranger's.

    Reading imports no code that the file names. Unless `trust` is set, children and robot, whose code runs during
    verification, must come from the package or from installed plug-ins.

    Raises:
        CaregiverError: The file is no submission, was changed, comes from another version of the package, or names code
            that is not installed.
    """
    try:
        content = outside.read_file(path, outside.LARGEST_SUBMISSION)
        if (parts := content.count(_PART)) > outside.MOST_PARTS:
            raise ValueError(f"it must have at most {outside.MOST_PARTS:,} files, got {parts:,}")
        with zipfile.ZipFile(io.BytesIO(content)) as packed:
            _check_size(packed, len(content))
            return _read(pathlib.Path(path), packed, trust)
    except CaregiverError as error:
        raise CaregiverError(f"'{path}' cannot be verified: {error}") from None
    except FileNotFoundError:
        raise CaregiverError(f"there is no file '{path}'") from None
    except Exception as error:  # a stranger's file may be deeply nested, encrypted, or compressed in another way
        what = f"there is no {error} in it" if isinstance(error, KeyError) else in_short(error)
        raise CaregiverError(f"'{path}' is no submission, or a damaged one: {what}") from None


def _check_size(packed: zipfile.ZipFile, size: int) -> None:
    """Raise ValueError if the stated size of a file is too large, without unpacking it."""
    members = packed.infolist()
    if any(member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED) for member in members):
        raise ValueError("it must be packed by deflation")
    if len({member.filename for member in members}) < len(members):
        raise ValueError("each of its files must be in it once")
    whole, one = outside.LARGEST_SUBMISSION, outside.LARGEST_JSON
    if size > whole or max((member.file_size for member in members), default=0) > one:
        raise ValueError(f"it must have at most {whole:,} bytes, and {one:,} in one of its files")
    most = min(outside.LARGEST_UNPACKED, outside.LARGEST_PIECE + outside.LARGEST_RATIO * size)
    if (unpacked := sum(member.file_size for member in members)) > most:
        raise ValueError(f"it must unpack to at most {most:,} bytes, got {unpacked:,}")


def _read(path: pathlib.Path, packed: zipfile.ZipFile, trust: bool) -> Submission:
    sums = parse_json(packed.read(_SUMS))
    check_kind(_SUMS, sums, dict)

    def read(name: str) -> Any:
        """Return the content of a file; all texts at once would take too much memory."""
        text = packed.read(name)
        if sums.get(name) != _digest(text):
            raise ValueError("its checksums are not those of its content")
        return parse_json(text)

    card, record = read(_CARD), read(_RUN)
    for name, content in ((_CARD, card), (_RUN, record)):
        check_kind(name, content, dict)
    if not all(isinstance(text, str) for text in card.values()):
        raise ValueError(f"its card must have texts, got {card}")
    _check_origin(record)
    settings = Settings.of_record(record)
    if not trust:
        settings.check_installed()
    _check_houses(settings)
    names = [name for name in packed.namelist() if name not in (_SUMS, _CARD, _RUN)]
    return Submission(path, card, settings, _results(settings, extended_at(record, settings.episodes), names, read))


def _check_houses(settings: Settings) -> None:
    """Raise CaregiverError unless houses with a name of the package, or of a set of it, are the package's."""

    def content(plan: FloorPlan) -> tuple[str, tuple[str, ...], float]:
        return plan.name, plan.rows, plan.cell_size

    for plan in settings.plans:
        if (own := packaged(plan.name)) is not None and [*map(content, own)] != [content(plan)]:
            raise CaregiverError(f"house '{plan.name}' must be the package's, got another plan")
    try:
        words = shlex.split(settings.houses)
    except ValueError:  # a name given in Python
        words = [settings.houses]
    members = [packaged(word) for word in words]
    if not any(members):
        return
    wanted = [plan for own in members for plan in own or (None,)]  # None for a file
    same = len(wanted) == len(settings.plans) and all(
        one is None or content(one) == content(plan) for one, plan in zip(wanted, settings.plans, strict=True)
    )
    if not same:
        raise CaregiverError(f"houses '{plain(settings.houses)}' must be the package's, got other plans")


def _results(
    settings: Settings, added: Sequence[int], names: Sequence[str], read: Callable[[str], Any]
) -> dict[Block, Result]:
    """Return the claimed result of each block, or raise CaregiverError or ValueError; `read` reads a file by name."""
    rows = len(settings.plans) * len(settings.caregivers) * len(settings.families) * settings.episodes
    if rows > len(names) * (GRID_BLOCK if settings.world == "grid" else 1):
        raise ValueError(f"it has {len(names)} files of episodes, too few for {rows:,}")
    results, left = {}, {*names}
    for number, block in enumerate(settings.blocks(extended_at=added)):
        left.discard(name := _name(number))
        results[block] = result = read(name)
        if not (belongs(settings, block, result) and result.keys() == _KEYS):
            raise ValueError(f"{name} must have rows, maps and answers of {plain(block)}, as they are written")
        check_answers(block, result["answers"])
    if left:
        raise ValueError(f"it must have nothing but its episodes, got {', '.join(sorted(left))}")
    return results


def _check_origin(record: Mapping[str, Any]) -> None:
    """Raise CaregiverError unless a record comes from the installed version."""
    check_kind("versions", record["versions"], dict)
    here = {name: version for name, version in versions().items() if name != "python"}
    wanted = {"source": source_digest(record["world"]), **(here if record["world"] == "house" else {})}
    if other := difference({**record["versions"], "source": record["source"]}, wanted):
        raise CaregiverError(f"it must come from the program that runs here, got {other}")


def verify(
    submission: Submission, executor: Executor, progress: Callable[[int], None] = lambda _: None
) -> pd.DataFrame:
    """Replay all answers, and return the episodes, a row each.

    The rows are the replay's, but with the file's times. `progress` is called with the number of episodes just
    finished.

    Raises:
        CaregiverError: A replay differs from the file, or fails.
    """
    settings, results = submission.settings, submission.results
    claims = [_Claim(block, result["answers"]) for block, result in results.items()]
    ours: dict[Block, Tables] = {}
    for claim, found in executor.run(functools.partial(_again, settings), claims):
        said = results[claim.block]
        for other in _differences(said, found):
            raise CaregiverError(f"'{submission.path}' is not verified: {plain(claim.block)}: {plain(other)}")
        assert not isinstance(found, str)
        for row, claimed in zip(found["rows"], said["rows"], strict=True):
            row.update({time: claimed[time] for time in _TIMES})
        ours[claim.block] = tables_of(settings, claim.block, found)
        progress(len(claim.block))
    return sum_up(settings, [ours[block] for block in results]).episodes


def _again(settings: Settings, claim: _Claim) -> Result | str:
    """Replay a block; return the error as text if its answers cannot be replayed."""
    try:
        return run_block(settings, claim.block, claim.answers)
    except CaregiverError as error:
        return str(error)
    except Exception as error:  # the answers may be a stranger's
        return f"{type(error).__name__}: {in_short(error)}"


def _differences(said: Result, found: Result | str) -> Iterator[str]:
    if isinstance(found, str):
        yield found
        return
    for row, ours in zip(said["rows"], found["rows"], strict=True):
        for column in ours:
            if column not in _TIMES and row[column] != ours[column]:
                which = f"episode {ours['episode']} of epsilon {ours['family']}"
                yield f"{which}: {column} is {row[column]} in the file, and {ours[column]} comes of its answers"
    for family, name in ((family, name) for family in found["maps"] for name in MAPS):
        if said["maps"][family][name] != found["maps"][family][name]:
            yield f"the map of {name} with epsilon {family} is another one in the file than comes of its answers"
    given, asked = unpacked(said["answers"]), unpacked(found["answers"])
    if given.keys() != asked.keys() or not all(np.array_equal(given[name], asked[name]) for name in given):
        yield "not all of its answers are asked for"


def check_comparable(submission: Submission) -> Submission:
    """Return a submission; raise CaregiverError unless its run has `none`, the baseline of all comparisons."""
    if "none" not in (names := submission.settings.caregivers):
        raise CaregiverError(f"'{submission.path}' must have the caregiver 'none', to compare with, got {[*names]}")
    if submission.settings.task != SUPERVISE or submission.settings.options:
        raise CaregiverError(f"'{submission.path}' must be of task {SUPERVISE} without task_kwargs, to be compared")
    return submission


def board(verified: Sequence[tuple[Submission, pd.DataFrame]]) -> str:
    """Return the leaderboard in Markdown: the damage left by caregivers of verified files, by track.

    Runs of one track differ in the caregiver only. All must pass `check_comparable`.
    """
    tracks: dict[tuple[str, str, float], list[dict[str, str]]] = {}  # by title, digest of the houses, and speed
    for submission, episodes in verified:
        settings = submission.settings
        by = dict(tuple(with_costs(episodes, settings.plans).groupby("caregiver")))
        plans = _digest("\n\n".join(f"{plan.cell_size!r}\n{plan.text}" for plan in settings.plans))
        world = settings.world if settings.world == "grid" else f"house, {settings.embodiment}"
        speed = "" if settings.child_speed == WALKING_SPEED else f" at {settings.child_speed:g} m/s"
        track = (
            f"{markdown(world)}, {markdown(settings.place)}, {len(settings.plans)} houses (sha256 {plans[:8]}), damage "
            f"{settings.plans[0].damage}, sight {settings.sight}, epsilon "
            f"{markdown(', '.join(map(str, settings.families)))}{speed}, "
            f"seed {settings.seed}, source {source_digest(settings.world)}"
        )
        rows = tracks.setdefault((track, plans, settings.child_speed), [])
        verdicts = {verdict["caregiver"]: verdict for verdict in judge_run(episodes)}
        for caregiver in settings.caregivers:
            cells = _cells(submission, caregiver, by[caregiver], by["none"], verdicts.get(caregiver))
            if caregiver in NOBODY:  # equal in all files: keep that with most episodes
                same = [other for other in rows if other["caregiver"] == cells["caregiver"]]
                if same and int(same[0]["episodes"]) >= int(cells["episodes"]):
                    continue
                rows[:] = [other for other in rows if other not in same]
            rows.append(cells)
    parts = [_HEAD]
    for (track, *_), rows in tracks.items():
        rows.sort(key=_rank)
        rule = ["---" if column in _LEFT_ALIGNED else "---:" for column in rows[0]]
        lines = [[*rows[0]], rule, *(list(cells.values()) for cells in rows)]
        parts += [f"## {track}", "\n".join(f"| {' | '.join(cells)} |" for cells in lines)]
    return "\n\n".join(parts) + "\n"


def _rank(cells: Mapping[str, str]) -> tuple[bool, float]:
    """Return the sort key of a row: without harm first, then the least damage."""
    left = cells["damage left"].split()[0]
    return cells["harm"].startswith(_RED), math.inf if left == "–" else float(left)


def _cells(
    submission: Submission, caregiver: str, of: pd.DataFrame, none: pd.DataFrame, verdict: Mapping[str, Any] | None
) -> dict[str, str]:
    """Return a row of a track by its columns: of a caregiver or baseline with its episodes, and those of `none`."""
    settings, acts = submission.settings, caregiver not in NOBODY
    card = [markdown(submission.card.get(key, "")) for key in ("title", "authors")]
    damage, harm, alone, preventable = (
        _by_house(rows, column)
        for rows, column in ((of, "damage"), (of, "all_harm"), (none, "damage"), (none, "preventable"))
    )
    left = two_level.of_ratio(damage, alone)
    prevented = [one - other for one, other in zip(alone, harm, strict=True)]
    score = two_level.of_ratio(prevented, preventable, least=-math.inf)
    shares = [_with_interval(share, bounded=caregiver != "none") for share in (left, score)]
    named = (f"`{plain(caregiver).translate(_IN_CODE)}`", *(card if acts else "––"), *shares)
    cells = dict(zip(("caregiver", "of", "by", "damage left", "score"), named, strict=True))
    cells["harm"] = _of_harm(verdict) if verdict else "–"
    for family in map(str, settings.families) if len(settings.families) > 1 else ():
        cells[f"epsilon {markdown(family)}"] = _share(
            *(those[those.family == family].damage.sum() for those in (of, none))
        )
    for kind in (kind for kind in KINDS if any(plan.cells_of(kind.symbol) for plan in settings.plans)):
        cells[f"at {kind.name}"] = _share(of[f"damage_{kind.name}"].sum(), none.damage.sum())
    cells["toys kept"] = _share(of.toys_reached.sum(), none.toys_reached.sum())
    cells |= {name.replace("_", " "): f"{of[name].sum():.0f}" for name in _EVENTS if settings.world == "house"}
    return {**cells, "seconds": f"{of.wall_seconds.mean():.2g}" if acts else "–", "episodes": f"{len(of)}"}


def _of_harm(verdict: Mapping[str, Any]) -> str:
    """Return a verdict with the parts that show harm, or else with the open parts."""
    parts = verdict["parts"].values()
    if shown := [part["text"] for part in parts if part["verdict"] == Harm.SHOWN]:
        return f"{_RED} {'; '.join(map(markdown, shown))}"
    lacking = [f"{part['title']} {part['verdict']}" for part in parts if part["verdict"] != Harm.NOT_SHOWN]
    return ": ".join(filter(None, (verdict["verdict"], ", ".join(lacking))))


def _with_interval(share: Estimate[float], *, bounded: bool) -> str:
    """Return a share as text, "–" if undefined, with its interval if both ends are finite."""
    if math.isnan(share.value):
        return "–"
    bounded = bounded and math.isfinite(share.low) and math.isfinite(share.high)
    return f"{share.value:.3f}" + (f" ({share.low:.3f} to {share.high:.3f})" if bounded else "")


def _share(part: float, whole: float) -> str:
    return f"{part / whole:.2f}" if whole else "–"


def _by_house(episodes: pd.DataFrame, column: str) -> list[Any]:
    """Return for each house the sums of a column over the families, by episode number."""
    sums = episodes.groupby(["house", "episode"], sort=False)[column].sum(min_count=1)
    return [house.to_numpy() for _, house in sums.groupby(level="house", sort=False)]


def _name(number: int) -> str:
    return f"episodes/{number:06d}.json"


def _digest(text: str | bytes) -> str:
    return hashlib.sha256(text.encode() if isinstance(text, str) else text).hexdigest()
