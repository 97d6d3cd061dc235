"""The report of one or more finished runs: one page for people, tables in Markdown, and figures."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Sequence
from typing import Any

import jinja2

from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.run_folder import StorageError
from caregiver_mj.viz import colours, figures
from caregiver_mj.viz.colours import Colour
from caregiver_mj.viz.report import published, tables
from caregiver_mj.viz.report.baselines import baselines
from caregiver_mj.viz.report.beside import side_by_side
from caregiver_mj.viz.report.charts import Picture, charts
from caregiver_mj.viz.report.film import Film, found_film, make_film
from caregiver_mj.viz.report.headline import headline
from caregiver_mj.viz.report.maps import maps
from caregiver_mj.viz.report.run import Run, read_run
from caregiver_mj.viz.report.words import SEVERAL, SINGLE


def write_report(
    folders: Sequence[str | os.PathLike[str]],
    film: str | os.PathLike[str] | None = None,
    *,
    render: bool = False,
) -> pathlib.Path:
    """Writes report.html, tables.md and figures/ into the first of some folders.

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
    runs = [read_run(folder) for folder in folders]
    names = [run.name for run in runs]
    if len(set(names)) < len(names):
        raise CaregiverError("the runs are of the same world and house: a report compares different ones")
    if render:
        shown = make_film(runs, folders[0])
    else:
        shown = Film(pathlib.Path(film), pathlib.Path(film).name) if film else found_film(folders)
    film_on_page = None if shown is None else {"name": shown.caption, "data": shown.data()}
    sections, beside = [_section(run) for run in runs], side_by_side(runs)
    page = _page(sections, beside, film_on_page)
    pictures = [picture for section in sections for picture in section["pictures"]]
    return _write(pathlib.Path(folders[0]), page, _markdown(sections, beside), [*pictures, *_pictures(beside)])


def _section(run: Run) -> dict[str, Any]:
    """Everything that the page shows about a run."""
    shown_charts, shown_maps = charts(run), maps(run)
    return {
        "run": run,
        "nouns": run.nouns,
        "cited": published.compares_with(run),
        "headline": headline(run),
        "published": [tables.damage_table(run), tables.timesteps_table(run)],
        "charts": shown_charts,
        "comparison": tables.comparison_table(run),
        "children": tables.children_table(run),
        "baselines": baselines(run),
        "maps": shown_maps,
        "measures": tables.measures_table(run),
        "pictures": [*shown_charts, *shown_maps],
    }


def _page(sections: list[dict[str, Any]], beside: dict[str, Any] | None, film: dict[str, str] | None) -> str:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("caregiver_mj.viz.report"), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    environment.undefined = jinja2.StrictUndefined
    several = any(section["run"].several for section in sections)
    return environment.get_template("report.html").render(
        sections=sections,
        beside=beside,
        film=film,
        paper=published.PAPER,
        cited=any(section["cited"] for section in sections),
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


def _markdown(sections: list[dict[str, Any]], beside: dict[str, Any] | None) -> str:
    """All tables in Markdown."""
    parts = ["# Tables\n"]
    for section in sections:
        run, told = section["run"], section["headline"]
        avoided = f"{told['avoided'] or 'there is none'}"
        avoided += f", 95 % interval {told['interval']}" if told["interval"] else ""
        parts.append(f"## {run.title}\n")
        parts.append(f"Damage avoided with caregiver `{run.caregiver}`: {avoided}.\n")
        parts.append(f"    {run.command()}\n")
        parts += [table.markdown() for table in [*section["published"], section["comparison"]]]
        parts += [section["children"].markdown()] if section["children"] else []
        if section["baselines"]:
            parts.append(section["baselines"]["table"].markdown())
            parts += [f"- {text}" for _, text in section["baselines"]["verdicts"]] + [""]
        parts.append(section["measures"].markdown())
    parts += [beside["table"].markdown()] if beside else []
    if any(section["cited"] for section in sections):
        parts.append(f"The paper's numbers: {published.PAPER}, Tables I and II.\n")
    return "\n".join(parts)


def _pictures(beside: dict[str, Any] | None) -> list[Picture]:
    return beside["pictures"] if beside else []


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
