"""The report of one or more finished runs: one page for people, tables in Markdown, and figures."""

from __future__ import annotations

import os
import pathlib
import textwrap
from collections.abc import Sequence
from typing import Any

import jinja2
import numpy as np

from caregiver_mj.caregivers.registry import RULE
from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.run_folder import StorageError
from caregiver_mj.experiments.statistics import Sample
from caregiver_mj.plans.hazards import DamageWeights
from caregiver_mj.recording.record import DAMAGE_THRESHOLD
from caregiver_mj.viz import colours, figures
from caregiver_mj.viz.colours import Colour
from caregiver_mj.viz.report import published, tables
from caregiver_mj.viz.report.charts import Picture, bounded, charts, maps
from caregiver_mj.viz.report.child import child, why_all_timesteps
from caregiver_mj.viz.report.film import Film, found_film, make_film
from caregiver_mj.viz.report.left import kinds, left, side_by_side
from caregiver_mj.viz.report.run import Run, read_run
from caregiver_mj.viz.report.tables import HARM_IS, contacts, harm
from caregiver_mj.viz.report.words import SEVERAL, SINGLE, TITLES, number

_FACTS = {
    "timesteps_to_threshold": f"until damage is above {DAMAGE_THRESHOLD:g}",
    "cells_visited": "until then",
    "toys_reached": f"in {EPISODE_TIMESTEPS} timesteps",
}
_DEEDS = ("moves_blocked", "moves_blocked_stairwell", "moves_blocked_free", "interventions_done")
FITTED = (
    "House `paper` is not the house of the paper: that is its Figure 1, which we lack. It was chosen, of many plans, "
    "for coming closest to the paper's Tables I and II, to levels and to differences. So agreement with the paper in "
    "it validates nothing; what a caregiver is worth shows in houses that nobody chose."
)
EPSILON = (
    "Epsilon is the share of moves that are random, as in the names of the paper's novices; the paper's text (section "
    "V.B) writes epsilon for the other share."
)
SAME_RULE = (
    "`nearest` and the rule of the paper are the same but where every hazard left is four or more moves away: with one "
    "child 1 - P(safe) and what normalises distances are common to all hazards and cancel, and 5 (stairwell) against 4 "
    "(candle) decides only between distances such as 5 and 4."
)


def write_report(
    folders: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    film: str | os.PathLike[str] | None = None,
    *,
    render: bool = False,
) -> pathlib.Path:
    """Write report.html, tables.md and figures/ into the first of some folders.

    Whatever the order of the folders, runs over several houses come first, and house `paper` last.

    Args:
        folders: Of finished runs, each of another world or house.
        film: A film to show; by default the first in the folders, if there is one.
        render: Whether to film the first episode of a run instead.

    Returns:
        The path of the page.

    Raises:
        CaregiverError: Some folder has no finished run, or the film is not one.
        RenderingError: There is no OpenGL to render with.
        StorageError: The report could not be written.
    """
    folders = [folders] if isinstance(folders, str | os.PathLike) else folders
    if not folders:
        raise CaregiverError("a report must be of at least 1 run, got none")
    given = [read_run(folder) for folder in folders]
    places = [(run.settings.world, *(plan.name for plan in run.settings.plans)) for run in given]
    if len(set(places)) < len(places):
        raise CaregiverError(
            "runs of a report must be of different worlds or houses, got the same twice: use `compare`, or `pool` for "
            "runs of different seeds"
        )
    runs = sorted(given, key=lambda run: run.rank)
    shown: Film | None
    if render:
        shown = make_film(runs, folders[0])
    else:
        shown = Film(pathlib.Path(film), pathlib.Path(film).name) if film else found_film(folders)
    film_on_page = None if shown is None else {"name": shown.caption, "data": shown.data()}
    sections, beside = [section(run) for run in runs], side_by_side(runs)
    page = _page(sections, beside, film_on_page)
    pictures = [picture for one in sections for picture in one["pictures"]]
    pictures += beside["pictures"] if beside else []
    return _write(pathlib.Path(folders[0]), page, markdown(sections, beside), pictures)


def _page(sections: list[dict[str, Any]], beside: dict[str, Any] | None, film: dict[str, str] | None) -> str:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("caregiver_mj.viz.report"), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    environment.undefined = jinja2.StrictUndefined
    several = any(one["run"].several for one in sections)
    return environment.get_template("report.html").render(
        sections=sections,
        harm_is=HARM_IS,
        beside=beside,
        film=film,
        paper=published.PAPER,
        disclosures=disclosures([one["run"] for one in sections]),
        why_all_timesteps=why_all_timesteps(),
        cited=any(one["cited"] for one in sections),
        nouns=SEVERAL if several else SINGLE,
        several=several,
        colours=_css_colours(),
    )


def _css_colours() -> dict[str, str]:
    def css(colour: Colour) -> str:
        return "#" + "".join(f"{part:02x}" for part in colour)

    return {
        "ground": css(colours.GROUND),
        "alone": css(figures.ALONE),
        "guarded": css(figures.GUARDED),
        "highlight": css(colours.TODDLER),
    }


def _write(folder: pathlib.Path, page: str, tables_text: str, pictures: Sequence[Picture]) -> pathlib.Path:
    try:
        (folder / "figures").mkdir(exist_ok=True)
        for picture in pictures:
            (folder / "figures" / f"{picture.name}.svg").write_bytes(picture.svg)
            (folder / "figures" / f"{picture.name}.png").write_bytes(picture.png)
        (folder / "tables.md").write_text(tables_text, "utf-8")
        (folder / "report.html").write_text(page, "utf-8")
    except OSError as error:
        raise StorageError(f"the report in '{folder}' cannot be written: {error.strerror}") from error
    return folder / "report.html"


def section(run: Run) -> dict[str, Any]:
    """Return the parts by name; `pictures` are all that are in them."""
    parts = {
        "left": left(run),
        "kinds": kinds(run),
        "child": child(run),
        "charts": charts(run),
        "maps": maps(run) if run.houses == 1 else [],
    }
    pictures = [
        picture for part in parts.values() if part for picture in (part["pictures"] if isinstance(part, dict) else part)
    ]
    return parts | {
        "run": run,
        "nouns": run.nouns,
        "cited": published.compares_with(run),
        "bounded": bounded(run),
        "harm": harm(run),
        "headline": headline(run),
        "contacts": contacts(run),
        "published": [tables.damage_table(run), tables.timesteps_table(run)],
        "comparison": tables.comparison_table(run),
        "children": tables.children_table(run),
        "measures": tables.measures_tables(run),
        "pictures": pictures,
    }


def headline(run: Run) -> dict[str, Any]:
    """Return what the page begins with: `avoided`, the share of all families' damage that is avoided, and more."""
    # Families of the same episode share their chance, so it is episodes that are drawn again, all families together.
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
        "paper": _avoided_in_paper(run),
        "damage": {"alone": alone, "guarded": guarded, "most": max(alone, guarded) or 1.0},
        "facts": [
            (f"{TITLES[column]} {when}", number(run.mean("none", column)), number(run.mean(run.caregiver, column)))
            for column, when in _FACTS.items()
        ],
        "deeds": {c: number(run.mean(run.caregiver, c)) for c in _DEEDS if c in run.episodes},
        "mishaps": mishaps if run.settings.world == "house" else None,
        "guarded_episodes": len(guarded_episodes),
    }


def _avoided_in_paper(run: Run) -> str | None:
    """The same share in the paper, if it has all these novices."""
    means = [published.means(run, "damage_normalised", family) for family in run.families]
    known = [pair for pair in means if pair is not None]
    if len(known) < len(means):
        return None
    alone, guarded = np.sum(known, axis=0)
    return f"{100 * (1 - guarded / alone):.0f} %"


def markdown(sections: Sequence[dict[str, Any]], beside: dict[str, Any] | None) -> str:
    """Return the content of tables.md: all tables, with the figures that belong to them."""
    parts = ["# Tables\n", "## Harm\n"]
    for section in sections:
        parts += [f"{section['run'].title}. {section['harm']['sentence']}\n", section["harm"]["table"].markdown()]
    parts.append(f"{HARM_IS}\n")
    for section in sections:
        parts += _section(section)
    parts += [beside["table"].markdown(), *_figures(beside["pictures"])] if beside else []
    parts += ["## To know before comparing\n", *(f"- {text}" for text in disclosures([s["run"] for s in sections])), ""]
    if any(section["cited"] for section in sections):
        parts.append(f"The paper's numbers: {published.PAPER}, Tables I and II.\n")
    return "\n".join(parts)


def _section(section: dict[str, Any]) -> list[str]:
    """A run's part, as a list of paragraphs."""
    run, told, left, child = (section[name] for name in ("run", "headline", "left", "child"))
    avoided = told["avoided"] or "there is none"
    avoided += f", 95 % interval {told['interval']}" if told["interval"] else ""
    avoided += f"; of {number(told['damage']['alone'])} an episode alone, {number(told['damage']['guarded'])} is left"
    parts = [f"## {run.title}\n", f"Damage avoided with caregiver `{run.caregiver}`: {avoided}.\n"]
    parts += [textwrap.indent(run.command(), "    ") + "\n", left["table"].markdown()]
    parts += [f"{left['floor']}\n"] if left["floor"] else []
    parts += _figures(left["pictures"])
    parts += [left["wins"].markdown()] if left["wins"] else []
    parts += [*(f"- {text}" for _, text in left["verdicts"]), ""] if left["verdicts"] else []
    parts += [section["kinds"]["table"].markdown(), *_figures(section["kinds"]["pictures"])]
    if child:
        parts += [child["table"].markdown(), *_figures(child["pictures"]), f"{why_all_timesteps()}\n"]
        parts += [table.markdown() for table in child["more"]]
    parts += [table.markdown() for table in section["contacts"]["tables"]] if section["contacts"] else []
    parts += [table.markdown() for table in [*section["published"], section["comparison"]]]
    parts += [section["children"].markdown()] if section["children"] else []
    return parts + [table.markdown() for table in section["measures"]]


def _figures(pictures: Sequence[Picture]) -> list[str]:
    """Where to find them; of one that there is for narrow and for wide pages the wide one."""
    names = {picture.name for picture in pictures}
    shown = [picture for picture in pictures if f"{picture.name}_wide" not in names]
    return [f"![{picture.caption}](figures/{picture.name}.png)\n" for picture in shown]


def disclosures(runs: Sequence[Run]) -> list[str]:
    """Return those that concern some runs."""
    said = [FITTED] if any(published.compares_with(run) for run in runs) else []
    said += [EPSILON]
    return said + ([SAME_RULE] if any(map(_same_rule, runs)) else [])


def _same_rule(run: Run) -> bool:
    rules = "nearest" in run.settings.caregivers and run.caregiver in RULE
    return rules and run.settings.plans[0].damage == DamageWeights() and not run.several
