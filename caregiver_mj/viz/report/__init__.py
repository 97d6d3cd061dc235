"""The report of finished runs: an HTML page, tables in Markdown, and figures."""

from __future__ import annotations

import base64
import dataclasses
import os
import pathlib
from collections.abc import Iterable, Sequence
from typing import Any

import jinja2
import numpy as np
from matplotlib.colors import to_hex

from caregiver_mj.caregivers.registry import CAREGIVERS, PLAYERS, POLICIES, RULE, inner_name
from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.run_folder import StorageError
from caregiver_mj.experiments.statistics import Sample
from caregiver_mj.experiments.summary import HOW
from caregiver_mj.outside import MB, markdown, read_file, visible
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.recording.record import DAMAGE_THRESHOLD
from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import unit
from caregiver_mj.viz.figure_style import ALONE, GUARDED
from caregiver_mj.viz.report import left, tables
from caregiver_mj.viz.report.run import PAPER, Run, read_run
from caregiver_mj.viz.report.words import SEVERAL, SINGLE, TITLES, family_name, members, number

_FACTS = {
    "timesteps_to_threshold": f"until damage is above {DAMAGE_THRESHOLD:g}",
    "cells_visited": "until then",
    "toys_reached": f"in {EPISODE_TIMESTEPS} timesteps",
}
_DEEDS = ("moves_blocked", "moves_blocked_stairwell", "moves_blocked_free", "interventions_done")
FILM_NAME = "report.mp4"  # file of a film made for the report
LARGEST_FILM = 40 * MB  # bytes; the film becomes part of the page
_SECONDS, _SIZE = 15.0, (960, 540)  # s and pixels of a film made for the report
_COLOURS = {"ground": colours.GROUND, "alone": ALONE, "guarded": GUARDED, "highlight": colours.TODDLER}
_TYPICAL = 0.5  # preferred share of random moves of the filmed children


def write_report(
    folders: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    film: str | os.PathLike[str] | None = None,
    *,
    caregiver: str = "",
    render: bool = False,
    trust: bool = False,
) -> pathlib.Path:
    """Write report.html, tables.md and figures/ into the first of some folders; return the path of the page.

    Args:
        folders: Folders of finished runs, each of another world or house.
        film: The film to show; None for the first in the folders, if there is one.
        caregiver: The caregiver to report on, beside the others; "" for the paper's rule, or the first one that acts.
        render: Whether to film the first episode of a run instead.
        trust: Whether to do so even if the run names code that is not installed, or a server.

    Raises:
        CaregiverError: A folder has no finished run, or one without the caregiver, or the film is invalid, or filming
            requires trust.
        RenderingError: No OpenGL backend works.
        StorageError: The report cannot be written.
    """
    folders = [folders] if isinstance(folders, str | os.PathLike) else folders
    if not folders:
        raise CaregiverError("a report must be of at least 1 run, got none")
    given = [read_run(folder, caregiver) for folder in folders]
    places = [(run.settings.world, *(plan.name for plan in run.settings.plans)) for run in given]
    if len(set(places)) < len(places):
        raise CaregiverError(
            "runs of a report must be of different worlds or houses, got the same twice: use `compare`, or `pool` for "
            "runs of different seeds"
        )
    runs = sorted(given, key=lambda run: run.rank)
    if render:
        films: Iterable[tuple[pathlib.Path, str]] = [make_film(runs, folders[0], trust=trust)]
    else:
        there = (path for folder in folders for path in sorted(pathlib.Path(folder).glob("*.mp4")))
        films = ((path, path.name) for path in ([pathlib.Path(film)] if film else there))
    on_page = next(({"name": caption, "data": _film_data(path)} for path, caption in films), None)
    sections, beside = [section(run) for run in runs], left.side_by_side(runs)
    several = any(run.several for run in runs)
    environment = _environment()
    environment.globals |= {
        "sections": sections,
        "beside": beside,
        "paper": PAPER,
        "nearest_is_the_rule": any(map(nearest_is_the_rule, runs)),
        "harm_is": HOW,
        "cited": any(run.cited for run in runs),
        "several": several,
        "nouns": SEVERAL if several else SINGLE,
        "number": number,
        "film": on_page,
        "colours": {name: to_hex(unit(colour)) for name, colour in _COLOURS.items()},
    }
    folder, pictures = pathlib.Path(folders[0]), [picture for part in sections for picture in part["pictures"]]
    files = {name: environment.get_template(name).render().encode() for name in ("tables.md", "report.html")}
    for picture in pictures + (beside["pictures"] if beside else []):
        files |= {f"figures/{picture.name}.svg": picture.svg, f"figures/{picture.name}.png": picture.png}
    try:
        if (folder / "figures").is_symlink():
            raise CaregiverError(f"'{folder / 'figures'}' must be a folder, got a link, which is not followed")
        (folder / "figures").mkdir(exist_ok=True)
        for name, content in files.items():
            (folder / name).unlink(missing_ok=True)
            with open(folder / name, "xb") as file:  # never through a link of a stranger's folder
                file.write(content)
    except OSError as error:
        raise StorageError(f"the report in '{folder}' cannot be written: {error.strerror}") from error
    return folder / "report.html"


def _shown(value: Any) -> Any:
    """Return a value of a template without invisible characters, because names may be a stranger's."""
    return visible(value) if type(value) is str else value


def causes() -> list[str]:
    """Return the causes of deviations from the paper's numbers in house `paper`, in the report's words."""
    words: Any = _environment().get_template("words.txt").make_module({"cited": True, "nearest_is_the_rule": False})
    return [str(words.fitted), str(words.epsilon)]


def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("caregiver_mj.viz.report"),
        autoescape=jinja2.select_autoescape(["html"]),
        undefined=jinja2.StrictUndefined,
        finalize=_shown,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["markdown"] = markdown
    return environment


def section(run: Run) -> dict[str, Any]:
    """Return the parts of a run's section by name; `pictures` has the pictures of all parts."""
    found, kinds, child = left.left(run), left.kinds(run), tables.child(run)
    charts, maps = left.charts(run), left.maps(run) if run.houses == 1 else []
    return {
        "run": run,
        "harm": tables.harm(run),
        "headline": headline(run),
        "left": found,
        "kinds": kinds,
        "child": child,
        "charts": charts,
        "maps": maps,
        "pictures": [*found["pictures"], *kinds["pictures"], *child["pictures"], *charts, *maps],
        # A single episode does not bound the mean.
        "bounded": any(row["damage_ci_high"] is not None for row in run.summary["rows"]),
        "contacts": tables.contacts(run),
        "published": [tables.damage_table(run), tables.timesteps_table(run)],
        "comparison": tables.comparison_table(run),
        "children": tables.children_table(run),
        "measures": tables.measures_tables(run),
    }


def headline(run: Run) -> dict[str, Any]:
    """Return the numbers at the top of the page, such as `avoided`, the share of all families' damage avoided."""
    # Families of an episode share random numbers, so the resampling unit is the episode with all families.
    damage = run.episodes.groupby(["caregiver", "house", "episode"])["damage"].sum().reset_index()
    ours, theirs = (Sample(damage[damage.caregiver == name]) for name in (run.caregiver, "none"))
    left, low, high = ours.estimators.of_ratio(ours.values(["damage"]), theirs.values(["damage"])).column(0)
    alone, guarded = (run.mean(caregiver, "damage") for caregiver in ("none", run.caregiver))
    guarded_episodes = run.episodes[run.episodes.caregiver == run.caregiver]
    mishaps = {column: int(guarded_episodes[column].sum()) for column in ("strikes", "candles_dropped")}
    return {
        "avoided": f"{number(100 * (1 - left), 0)} %" if np.isfinite(left) else None,
        "interval": f"{number(100 * (1 - high))} to {number(100 * (1 - low))} %" if np.isfinite(high) else None,
        "left": f"{number(left, 2)} [{number(low, 2)}, {number(high, 2)}]" if np.isfinite(high) else None,
        "open": bool(np.isinf(high)),
        "paper": run.published_avoided(),
        "damage": {"alone": alone, "guarded": guarded, "most": max(alone, guarded) or 1.0},
        "facts": [
            (f"{TITLES[column]} {when}", number(run.mean("none", column)), number(run.mean(run.caregiver, column)))
            for column, when in _FACTS.items()
        ],
        "deeds": {c: number(run.mean(run.caregiver, c)) for c in _DEEDS if c in run.episodes},
        "mishaps": mishaps if run.settings.world == "house" else None,
        "guarded_episodes": len(guarded_episodes),
    }


def nearest_is_the_rule(run: Run) -> bool:
    """Return whether `nearest` ran beside the paper's rule under conditions in which the two nearly agree."""
    both = "nearest" in run.settings.caregivers and run.caregiver in RULE
    return both and run.settings.plans[0].damage == DamageWeights() and not run.several


# -- The film ----------------------------------------------------------------------------------------


def _film_data(path: pathlib.Path) -> str:
    """Return a film as part of a page; raise CaregiverError if it cannot be read, is no MP4, or is too large."""
    try:
        content = read_file(path, LARGEST_FILM)
    except OSError as error:
        raise CaregiverError(f"the film '{path}' cannot be part of the page: {error.strerror}") from None
    if content[4:8] != b"ftyp":  # the start of every MP4 file
        raise CaregiverError(f"the film must be an MP4, got '{path}'")
    return f"data:video/mp4;base64,{base64.b64encode(content).decode()}"


def make_film(runs: Sequence[Run], folder: str | os.PathLike[str], *, trust: bool = False) -> tuple[pathlib.Path, str]:
    """Film the first episode of one of a report's runs into a folder; return the film's path and caption.

    Raises:
        CaregiverError: Its caregiver, children or robot are neither the package's nor installed, without `trust`.
    """
    from caregiver_mj.viz import film  # takes a second to import, and OpenGL to run

    # A run in the house, else the first one, whose children can walk there, too.
    run = next((run for run in runs if run.settings.world == "house"), runs[0])

    if not trust:  # a run in the grid is filmed in the house, too
        dataclasses.replace(run.settings, world="house").check_installed()
        if inner_name(run.caregiver) not in (*CAREGIVERS, *POLICIES, *PLAYERS):  # `render_episode` refuses players
            raise CaregiverError(
                f"the film must be of a caregiver that is installed, got '{run.caregiver}': --trust runs or asks it"
            )

    def from_typical(family: str) -> float:
        return abs(float(np.mean([epsilon for _, epsilon in members(family)])) - _TYPICAL)

    family = min(run.families, key=from_typical)
    path = pathlib.Path(folder) / FILM_NAME
    spec = run.settings.spec(run.settings.plans[0], ChildGroup.named(family), run.caregiver)
    film.render_episode(path, spec, seconds=_SECONDS, picture=film.Picture(*_SIZE))
    whose = "of the run" if run.settings.world == "house" else "with the children of the run in the grid"
    return path, f"Episode 0 {whose}, {family_name(family)}, caregiver {run.caregiver}"
