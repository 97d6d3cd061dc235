"""A run as one file that others can verify: its settings, its rows, and what its caregivers answered.

To verify it the answers are given again, with no caregiver present, and every row has to come back bit for bit. That
proves what the answers come to, and not how they were found: one could be told the children's goals.
"""

from __future__ import annotations

import functools
import hashlib
import io
import json
import math
import os
import pathlib
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import pandas as pd

from caregiver_mj.caregivers.answers import unpacked
from caregiver_mj.errors import CaregiverError, check_integer, check_kind
from caregiver_mj.experiments import two_level
from caregiver_mj.experiments.blocks import MAPS, belongs, run_block, tables_of
from caregiver_mj.experiments.evaluation import sum_up
from caregiver_mj.experiments.finished import read_finished
from caregiver_mj.experiments.harm import HOW, Harm
from caregiver_mj.experiments.provenance import difference, source_digest, versions
from caregiver_mj.experiments.run_folder import Result, RunFolder, write_whole
from caregiver_mj.experiments.settings import FLOOR, GRID_BLOCK, WORLDS, Block, Settings
from caregiver_mj.experiments.summary import judge_run
from caregiver_mj.experiments.workers import Executor
from caregiver_mj.plans.hazards import KINDS

SUFFIX = ".submission"
_CARD, _RUN, _SUMS = "card.json", "run.json", "sha256.json"
_MOST = 1 << 32  # bytes that a file may come to
_KEYS = {"rows", "maps", "answers"}  # of what came of a block
_EVENTS = ("strikes", "candles_dropped")  # of the house
_TO_THE_LEFT = ("caregiver", "of", "by", "harm")  # columns
_RED = "**HARM**:"  # what marks a row
_TIMES = ("wall_seconds",)  # that an episode took is not the same again
_HEAD = f"""# Leaderboard

Every row has come back, bit for bit, from its file, but for the seconds an episode, which its author's machine took.
Damage left: over that of `none`, with a 95 % interval over houses; also at each epsilon, and by kind of hazard, of all
damage of `none`. Toys kept: over those that children reach with `none`.

Least damage left comes first, but a caregiver that does harm, by any of its three parts, stands below all that do not,
`none` among them: no damage avoided makes up for a child that is struck. {HOW}"""


class Submission(NamedTuple):
    """What is in a file.

    Attributes:
        path: The file.
        card: What its authors say of it: `title`, `authors` and `notes`.
        settings: What ran.
        results: What is said to have come of it, by block.
    """

    path: pathlib.Path
    card: Mapping[str, str]
    settings: Settings
    results: Mapping[Block, Result]


class _Claim(NamedTuple):
    """A block, and what its caregiver answered."""

    block: Block
    answers: str

    def __str__(self) -> str:
        return str(self.block)


def submit(run: str | os.PathLike[str], path: str | os.PathLike[str], card: Mapping[str, str]) -> Settings:
    """Pack the finished run in a folder into `FILE.submission`, with a card of what its authors say of it.

    Returns:
        What ran.

    Raises:
        CaregiverError: The run is not finished, or does not have what its caregivers answered, or the file cannot be
            written.
    """
    found, path = read_finished(run), pathlib.Path(path)
    if path.suffix != SUFFIX:
        raise CaregiverError(f"the file must be called FILE{SUFFIX}, got '{path}'")
    if "pooled" in found.record:
        raise CaregiverError(f"the run in '{run}' must be one run, got several pooled: submit each of them")
    folder = RunFolder(run, found.settings.record(), resume=True)
    files: dict[str, Any] = {_CARD: dict(card), _RUN: found.record}
    for number, block in enumerate(found.settings.blocks(extended_at=folder.extended_at)):
        result = folder.read(str(block))
        if result is None:
            raise CaregiverError(
                f"the run in '{run}' has lost episodes ({block}): `caregiver-mj evaluate --resume` runs them again"
            )
        if not result.get("answers") and block.caregiver not in ("none", FLOOR):
            raise CaregiverError(
                f"the run in '{run}' must have what '{block.caregiver}' answered, got nothing: one of an older version "
                "must be run again"
            )
        files[_name(number)] = result
    texts = {name: json.dumps(content, allow_nan=False) for name, content in files.items()}
    sums = {name: _digest(text) for name, text in texts.items()}
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, text in {**texts, _SUMS: json.dumps(sums)}.items():
            packed.writestr(zipfile.ZipInfo(name), text, zipfile.ZIP_DEFLATED)  # without the time: the same again
    write_whole(path, content.getvalue())
    return found.settings


def read_submission(path: str | os.PathLike[str]) -> Submission:
    """Read a file that is to be verified.

    Raises:
        CaregiverError: It is none, or not as it was written, or comes from another version of the package.
    """
    try:
        with zipfile.ZipFile(path) as packed:
            if sum(member.file_size for member in packed.infolist()) > _MOST:
                raise ValueError(f"it comes to more than {_MOST >> 30} GB")
            texts = {name: packed.read(name).decode() for name in packed.namelist()}
        sums = json.loads(texts.pop(_SUMS))
        if sums != {name: _digest(text) for name, text in texts.items()}:
            raise ValueError("its checksums are not those of its content")
        card, record = json.loads(texts.pop(_CARD)), json.loads(texts.pop(_RUN))
        for name, content in ((_CARD, card), (_RUN, record)):
            check_kind(name, content, dict)
        _check_origin(record)
        settings = Settings.of_record(record)
        check_integer("episodes", settings.episodes, 1)
        check_integer("the seed", settings.seed, 0)
        if settings.world not in WORLDS:
            raise ValueError(f"there is no world '{settings.world}'")
        results = _results(settings, record.get("extended_at", ()), texts)
        if not all(isinstance(text, str) for text in card.values()):
            raise ValueError(f"its card must have texts, got {card}")
        return Submission(pathlib.Path(path), card, settings, results)
    except CaregiverError as error:
        raise CaregiverError(f"'{path}' cannot be verified: {error}") from None
    except FileNotFoundError:
        raise CaregiverError(f"there is no file '{path}'") from None
    except Exception as error:  # a file from anybody: deeply nested, encrypted, packed in other ways
        what = f"there is no {error} in it" if isinstance(error, KeyError) else " ".join(str(error).split())
        raise CaregiverError(f"'{path}' is no submission, or a damaged one: {what}") from None


def _results(settings: Settings, extended_at: Sequence[int], texts: dict[str, str]) -> dict[Block, Result]:
    """Return what is said to have come of settings, by block, from texts by the name of a file.

    Raises:
        ValueError: One is missing, or not as it is written, or has nothing to do with that.
    """
    rows = len(settings.plans) * len(settings.caregivers) * len(settings.families) * settings.episodes
    if rows < 1:
        raise ValueError("it has no house, no caregiver or no child")
    if rows > len(texts) * (GRID_BLOCK if settings.world == "grid" else 1):
        raise ValueError(f"it has {len(texts)} files of episodes, too few for {rows:,}")
    if [*extended_at] != sorted({*extended_at} & {*range(1, settings.episodes)}):
        raise ValueError(f"extended_at must be rising numbers of its episodes, got {extended_at}")
    results = {}
    for number, block in enumerate(settings.blocks(extended_at=extended_at)):
        results[block] = result = json.loads(texts.pop(_name(number)))
        if not (belongs(settings, block, result) and result.keys() == _KEYS):
            raise ValueError(f"{_name(number)} must have rows, maps and answers of {block}, as they are written")
    if texts:
        raise ValueError(f"it must have nothing but its episodes, got {', '.join(sorted(texts))}")
    return results


def _check_origin(record: Mapping[str, Any]) -> None:
    """Raise CaregiverError unless the same program runs here that a record is of."""
    here = {name: version for name, version in versions().items() if name != "python"}
    wanted = {"source": source_digest(record["world"]), **(here if record["world"] == "house" else {})}
    if other := difference({**record["versions"], "source": record["source"]}, wanted):
        raise CaregiverError(f"it must come from the program that runs here, got {other}")


def verify(
    submission: Submission, executor: Executor, progress: Callable[[int], None] = lambda _: None
) -> pd.DataFrame:
    """Give all answers again, and return the episodes that come of them, a row each; `progress` is told how many more.

    Raises:
        CaregiverError: Something else comes of them than the file says.
    """
    settings, results = submission.settings, submission.results
    claims = [_Claim(block, result["answers"]) for block, result in results.items()]
    for claim, found in executor.run(functools.partial(_again, settings), claims):
        for other in _differences(results[claim.block], found):
            raise CaregiverError(f"'{submission.path}' is not verified: {claim.block}: {other}")
        progress(len(claim.block))
    parts = [tables_of(settings, block, result) for block, result in results.items()]
    return sum_up(settings, parts).episodes


def _again(settings: Settings, claim: _Claim) -> Result | str:
    """Run a claim; return what is wrong with answers that cannot be given again."""
    try:
        return run_block(settings, claim.block, claim.answers)
    except CaregiverError as error:
        return str(error)


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
    if unpacked(said["answers"]) != unpacked(found["answers"]):
        yield "not all of its answers are asked for"


def check_comparable(submission: Submission) -> Submission:
    """Return a submission; raise CaregiverError unless its run has `none`, with which the others are compared."""
    if "none" not in (names := submission.settings.caregivers):
        raise CaregiverError(f"'{submission.path}' must have the caregiver 'none', to compare with, got {[*names]}")
    return submission


def board(verified: Sequence[tuple[Submission, pd.DataFrame]]) -> str:
    """Return a page in Markdown: what caregivers of verified files leave of the damage, those of one track together.

    Those of one track have all but the caregiver alike. All of them pass `check_comparable`.
    """
    tracks: dict[str, list[dict[str, str]]] = {}
    for submission, episodes in verified:
        settings, by = submission.settings, dict(tuple(episodes.groupby("caregiver")))
        plans = _digest("\n\n".join(f"{plan.cell_size:g}\n{plan.text}" for plan in settings.plans))[:8]
        world = settings.world if settings.world == "grid" else f"house, {settings.embodiment}"
        track = (
            f"{world}, {_in_a_cell(settings.place)}, {len(settings.plans)} houses (sha256 {plans}), damage "
            f"{settings.plans[0].damage}, sight {settings.sight}, epsilon {', '.join(map(str, settings.families))}, "
            f"seed {settings.seed}, source {source_digest(settings.world)}"
        )
        rows = tracks.setdefault(track, [])
        verdicts = {verdict["caregiver"]: verdict for verdict in judge_run(episodes)}
        for caregiver in settings.caregivers:
            cells = _cells(submission, caregiver, by[caregiver], by["none"], verdicts.get(caregiver))
            rows += [cells] if cells not in rows else []  # what is nobody's is the same in every file
    parts = [_HEAD]
    for track, rows in tracks.items():
        rows.sort(key=_rank)
        rule = ["---" if column in _TO_THE_LEFT else "---:" for column in rows[0]]
        lines = [[*rows[0]], rule, *(list(cells.values()) for cells in rows)]
        parts += [f"## {track}", "\n".join(f"| {' | '.join(cells)} |" for cells in lines)]
    return "\n\n".join(parts) + "\n"


def _rank(cells: Mapping[str, str]) -> tuple[bool, float]:
    """Return where a row stands: those with harm come last, else the least damage first."""
    left = cells["damage left"].split()[0]
    return cells["harm"].startswith(_RED), math.inf if left == "–" else float(left)


def _cells(
    submission: Submission,
    caregiver: str,
    of: pd.DataFrame,
    none: pd.DataFrame,
    verdict: Mapping[str, Any] | None,
) -> dict[str, str]:
    """Return a row of a track by its columns, of a caregiver's episodes and those in which nobody takes care.

    The verdict is that of the caregiver, if it acts.
    """
    settings, acts = submission.settings, verdict is not None
    card = [_in_a_cell(submission.card.get(key, "")) for key in ("title", "authors")]
    left = two_level.of_ratio(_by_house(of), _by_house(none))
    interval = f" ({left.low:.3f} to {left.high:.3f})" if caregiver != "none" and math.isfinite(left.high) else ""
    share = "–" if math.isnan(left.value) else f"{left.value:.3f}{interval}"  # of no damage at all
    named = (f"`{_in_a_cell(caregiver)}`", *(card if acts else "––"), share)
    cells = dict(zip(("caregiver", "of", "by", "damage left"), named, strict=True))
    cells["harm"] = _in_a_cell(_of_harm(verdict)) if verdict else "–"
    for family in map(str, settings.families) if len(settings.families) > 1 else ():
        cells[f"epsilon {family}"] = _share(*(those[those.family == family].damage.sum() for those in (of, none)))
    for kind in (kind for kind in KINDS if any(plan.cells_of(kind.symbol) for plan in settings.plans)):
        cells[f"at {kind.name}"] = _share(of[f"damage_{kind.name}"].sum(), none.damage.sum())
    cells["toys kept"] = _share(of.toys_reached.sum(), none.toys_reached.sum())
    cells |= {name.replace("_", " "): f"{of[name].sum():.0f}" for name in _EVENTS if settings.world == "house"}
    return {**cells, "seconds": f"{of.wall_seconds.mean():.2g}" if acts else "–", "episodes": f"{len(of)}"}


def _of_harm(verdict: Mapping[str, Any]) -> str:
    """Return a verdict, and what each part that shows harm says, or which parts are open."""
    parts = verdict["parts"].values()
    if shown := [part["text"] for part in parts if part["verdict"] == Harm.SHOWN]:
        return f"{_RED} {'; '.join(shown)}"
    lacking = [f"{part['title']} {part['verdict']}" for part in parts if part["verdict"] != Harm.NOT_SHOWN]
    return ": ".join(filter(None, (verdict["verdict"], ", ".join(lacking))))


def _in_a_cell(text: str) -> str:
    """Return somebody's text without what would mean something in a table of Markdown."""
    return " ".join(text.split()).replace("|", "/").replace("<", "&lt;")


def _share(part: float, whole: float) -> str:
    return f"{part / whole:.2f}" if whole else "–"


def _by_house(episodes: pd.DataFrame) -> list[Any]:
    """Return for each house the damage of each episode number, added up over the families."""
    damage = episodes.groupby(["house", "episode"], sort=False).damage.sum()
    return [house.to_numpy() for _, house in damage.groupby(level="house", sort=False)]


def _name(number: int) -> str:
    return f"episodes/{number:06d}.json"


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
